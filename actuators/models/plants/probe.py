"""A mass on a spring with a voice coil that feeds a filter: a plant with a sensor chain."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import GY, BondGraph, C, De, Dq, I, One, R, Se, Zero


def probe() -> BondGraph:
    """Return a mass on a spring with a voice coil that feeds a filter.

    F - m, k, b - K_g - R_g in series with C_f.

    Measured are the displacement and the voltage of the filter. The coil gives ``K_g dx/dt`` and
    pushes back with ``K_g i``.
    """
    with BondGraph("probe") as g:
        body, coil, node = One("body"), One("coil"), Zero("node")
        Se("F", unit="N") >> body >> I("m", 0.2, unit="kg", spread=SPREAD)
        body >> C("k", stiffness=8000.0, unit="N/m", spread=SPREAD)
        body >> R("b", 2.0, unit="N*s/m", spread=SPREAD)
        body >> GY("K_g", ratio=20.0, unit="V*s/m", spread=SPREAD) >> coil
        coil >> R("R_g", 200.0, unit="ohm", spread=SPREAD)
        coil >> node >> C("C_f", 1e-5, unit="F", spread=SPREAD)
        body >> Dq("x", unit="m")
        node >> De("v_f", unit="V")
    return g
