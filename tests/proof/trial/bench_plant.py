"""The plants of the sealed trial on a virtual bench, nominal or as a case conceals them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput, unknown_name
from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.drawing import draw
from hardware.simulators.generator.making import together
from hardware.simulators.generator.parameters import PLANTS
from hardware.simulators.generator.sizing import CaseBench, Sized, bench_of, size
from hardware.simulators.plants import GeneratedPlant


def trial_plant(
    what: str | DrawnCase,
    *,
    displacement: str | None = None,
    current: str | None = None,
    parameters: Mapping[str, float] | None = None,
    span: float | None = None,
) -> GeneratedPlant:
    """Return a plant of the trial.

    Parameters
    ----------
    what : str or DrawnCase
        Name of a plant, or a case; its effects get the strengths they have in the trial.
    displacement : str, optional
        Sensor that the interferometer sees; by default the first that reads metres.
    current : str, optional
        Sensor that reads amperes; by default that of the plant, if there is one.
    parameters : mapping, optional
        True values that differ.
    span : float, optional
        Time (s) in which what changes with time does so; that of the case's record by default, or
        10 s.

    Raises
    ------
    UnknownName
        A plant or a sensor that does not exist.
    UnusableInput
        A plant without displacement, or an effect that belongs to a clock.
    """
    case = what if isinstance(what, DrawnCase) else None
    name = case.plant if case else str(what)
    if name not in PLANTS:
        raise unknown_name("plant", name, "sealed trial", PLANTS)
    plant = PLANTS[name]
    for sensor in (displacement, current):
        if sensor is not None and sensor not in plant.sensors:
            raise unknown_name("sensor", sensor, f"trial plant {name}", plant.sensors)
    for given in parameters or {}:
        if given not in plant.nominal:
            raise unknown_name("parameter", given, name, plant.nominal)
    if displacement is None and "m" not in plant.sensors.values():
        raise UnusableInput(
            f"trial plant {name}: no sensor reads metres; take one of "
            f"{', '.join(n for n, p in PLANTS.items() if 'm' in p.sensors.values())}"
        )
    if case and any(e.place == "clock" for e in case.effects):
        raise UnusableInput(
            "trial plant: an effect of the clock; a bench has it in the clocks of its devices"
        )
    bench, sized = _sized(case) if case else (None, [])
    return GeneratedPlant(
        name,
        {**(case.parameters if case else {}), **(parameters or {})},
        sized,
        sized_on=bench,
        displacement=displacement,
        current=current,
        span=span or (case.samples * plant.step if case else 10.0),
        dead=float(case.extra.get("declared_delay", 0.0)) if case else 0.0,
    )


def truth_of_plant(plant: GeneratedPlant) -> dict[str, Any]:
    """Return what is concealed, as plain values."""
    return {
        "effects": [
            {
                "effect": e.hidden.effect,
                "place": e.hidden.place,
                "law": e.hidden.law,
                "strength": e.strength,
                "numbers": {k: v for k, v in e.numbers.items() if not k.startswith("_")},
            }
            for e in plant.effects
        ]
    }


def _sized(case: DrawnCase) -> tuple[CaseBench | None, list[Sized]]:
    """Give the effects the strengths that they have in the case's record."""
    if not case.effects:
        return None, []
    bench = bench_of(case)
    plain = bench.simulate([])
    assert plain is not None
    names = list(PLANTS[case.plant].sensors)
    kept = [names.index(k) for k in case.sensors]
    std = np.std(plain[1], axis=0) * 10 ** (-case.noise["snr_db"] / 20)

    def excess(samples: Array) -> float:
        ratio = np.mean((samples - plain[1]) ** 2, axis=0) / std**2
        return float(10 * np.log10(np.mean(ratio[kept]) + 1e-12))

    return bench, together(bench, [size(bench, h, excess)[0] for h in case.effects])[1]


def drawn(seed: int, plant: str = "stack", cell: str = "single") -> GeneratedPlant:
    """Draw a case of the trial's development for a bench: one effect, none of a clock.

    Parameters
    ----------
    seed : int
        Seed; the same one gives the same case.
    plant : str
        Name of the plant.
    cell : str
        ``"single"`` for an effect of the catalogue, ``"outside"`` for one that is not in it.
    """
    for case in draw("development", seed, 400):
        if (case.plant, case.cell) == (plant, cell) and case.effects[0].place != "clock":
            return trial_plant(case)
    raise UnusableInput(f"trial plant: seed {seed} draws no {cell} case of {plant}; take another")
