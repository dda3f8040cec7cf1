"""A piezo stack behind the resistance of its amplifier."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import TF, BondGraph, C, Df, Dq, I, One, R, Se, Zero


def stack(
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

    Measured are the current through ``R_a`` and the displacement.

    Parameters
    ----------
    coupling : float
        ``alpha``, N/V; the ratio of the transformer from the node to the body is its inverse.
    """
    with BondGraph("stack") as g:
        loop, node, body = One("loop"), Zero("node"), One("body")
        Se("V", unit="V") >> loop >> R("R_a", resistance, unit="ohm", spread=SPREAD)
        loop >> node >> C("C_a", capacitance, unit="F", spread=SPREAD)
        node >> TF("alpha", ratio=1.0 / coupling, unit="V/N", spread=SPREAD) >> body
        body >> I("m", mass, unit="kg", spread=SPREAD)
        body >> C("k", stiffness=stiffness, unit="N/m", spread=SPREAD)
        body >> R("b", damping, unit="N*s/m", spread=SPREAD)
        loop >> Df("i", unit="A")
        body >> Dq("x", unit="m")
    return g
