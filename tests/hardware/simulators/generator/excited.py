"""A plant of the generator with values of its own, shaken."""

from __future__ import annotations

from bondgraph.support.arrays import FloatArray as Array
from hardware.simulators.generator.native import Row, Run, run
from hardware.simulators.generator.parameters import ALL_PLANTS


def moved(plant: str) -> dict[str, float]:
    """Values each moved by a factor of its own, so that no two elements are exchanged unseen."""
    nominal = ALL_PLANTS[plant].nominal
    return {k: v * (1 + 0.07 * i) for i, (k, (v, _)) in enumerate(nominal.items())}


def excited(plant: str, effects: tuple[Row, ...], u: Array, sub: int = 60) -> Run:
    made = run(plant, list(moved(plant).values()), effects, u, sub=sub, hold="linear")
    assert made is not None
    return made
