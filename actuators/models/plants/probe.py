"""A mass on a spring with a voice coil that feeds a filter: a plant with a sensor chain."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import SPREAD, wanted
from bondgraph import GY, BondGraph, C, De, Dq, I, One, R, Se, Zero

SENSORS = ("x", "v_f")


def probe(
    sensors: Sequence[str] | None = None,
    *,
    mass: float = 0.2,
    stiffness: float = 8000.0,
    damping: float = 2.0,
    constant: float = 20.0,
    resistance: float = 200.0,
    capacitance: float = 1e-5,
) -> BondGraph:
    """Return a mass on a spring with a voice coil that feeds a filter.

    F - m, k, b - K_g - R_g in series with C_f.

    Parameters
    ----------
    sensors : sequence of {"x", "v_f"}, optional
        Displacement (m) and voltage of the filter (V).
    constant : float
        ``K_g``, V s/m: the coil gives ``K_g dx/dt`` and pushes back with ``K_g i``.
    """
    read = wanted("probe", SENSORS, sensors)
    with BondGraph("probe") as g:
        body, coil, node = One("body"), One("coil"), Zero("node")
        Se("F", unit="N") >> body >> I("m", mass, unit="kg", spread=SPREAD)
        body >> C("k", stiffness=stiffness, unit="N/m", spread=SPREAD)
        body >> R("b", damping, unit="N*s/m", spread=SPREAD)
        body >> GY("K_g", ratio=constant, unit="V*s/m", spread=SPREAD) >> coil
        coil >> R("R_g", resistance, unit="ohm", spread=SPREAD)
        coil >> node >> C("C_f", capacitance, unit="F", spread=SPREAD)
        if "x" in read:
            body >> Dq("x", unit="m")
        if "v_f" in read:
            node >> De("v_f", unit="V")
    return g
