"""A piezo stack behind the resistance of its amplifier."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import SPREAD, wanted
from bondgraph import TF, BondGraph, C, Df, Dq, I, One, R, Se, Zero

SENSORS = ("i", "x")


def stack(
    sensors: Sequence[str] | None = None,
    *,
    resistance: float = 20.0,
    capacitance: float = 8e-6,
    coupling: float = 5.0,
    mass: float = 0.5,
    stiffness: float = 5e6,
    damping: float = 95.0,
) -> BondGraph:
    """Return a piezo stack that moves a mass, behind the resistance of its amplifier.

    V - R_a - C_a, coupled to m, k, b: force ``alpha v_C``, current ``alpha dx/dt``.

    Parameters
    ----------
    sensors : sequence of {"i", "x"}, optional
        Current through ``R_a`` (A) and displacement (m).
    coupling : float
        ``alpha``, N/V; the ratio of the transformer from the node to the body is its inverse.
    """
    read = wanted("stack", SENSORS, sensors)
    with BondGraph("stack") as g:
        loop, node, body = One("loop"), Zero("node"), One("body")
        Se("V", unit="V") >> loop >> R("R_a", resistance, unit="ohm", spread=SPREAD)
        loop >> node >> C("C_a", capacitance, unit="F", spread=SPREAD)
        node >> TF("alpha", ratio=1.0 / coupling, unit="V/N", spread=SPREAD) >> body
        body >> I("m", mass, unit="kg", spread=SPREAD)
        body >> C("k", stiffness=stiffness, unit="N/m", spread=SPREAD)
        body >> R("b", damping, unit="N*s/m", spread=SPREAD)
        if "i" in read:
            loop >> Df("i", unit="A")
        if "x" in read:
            body >> Dq("x", unit="m")
    return g
