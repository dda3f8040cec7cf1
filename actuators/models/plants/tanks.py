"""Three tanks in a row."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import BondGraph, C, De, One, R, Sf, Zero


def tanks() -> BondGraph:
    """Return three tanks in a row, filled into the first.

    q_in - C_1 - R_12 - C_2 - R_23 - C_3 - R_out.

    Measured are the pressures at the bottom of the tanks.
    """
    with BondGraph("tanks") as g:
        rooms = [Zero(f"tank_{i}") for i in (1, 2, 3)]
        Sf("q_in", unit="m3/s") >> rooms[0]
        for i, (room, size) in enumerate(zip(rooms, (1e-5, 0.8e-5, 1.2e-5), strict=True), start=1):
            room >> C(f"C_{i}", size, unit="m3/Pa", spread=SPREAD)
            room >> De(f"p_{i}", unit="Pa")
        for a, b in ((1, 2), (2, 3)):
            through = One(f"pipe_{a}{b}")
            rooms[a - 1] >> through >> rooms[b - 1]
            through >> R(f"R_{a}{b}", 1e7, unit="Pa*s/m3", spread=SPREAD)
        rooms[2] >> R("R_out", 1.5e7, unit="Pa*s/m3", spread=SPREAD)
    return g
