"""Three tanks in a row."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import SPREAD, wanted
from bondgraph import BondGraph, C, De, One, R, Sf, Zero

SENSORS = ("p_1", "p_2", "p_3")


def tanks(
    sensors: Sequence[str] | None = None,
    *,
    capacities: tuple[float, float, float] = (1e-5, 0.8e-5, 1.2e-5),
    pipe: float = 1e7,
    outlet: float = 1.5e7,
) -> BondGraph:
    """Return three tanks in a row, filled into the first.

    q_in - C_1 - R_12 - C_2 - R_23 - C_3 - R_out.

    Parameters
    ----------
    sensors : sequence of {"p_1", "p_2", "p_3"}, optional
        Pressures at the bottom of the tanks, Pa.
    """
    read = wanted("tanks", SENSORS, sensors)
    with BondGraph("tanks") as g:
        rooms = [Zero(f"tank_{i}") for i in (1, 2, 3)]
        Sf("q_in", unit="m3/s") >> rooms[0]
        for i, room in enumerate(rooms, start=1):
            room >> C(f"C_{i}", capacities[i - 1], unit="m3/Pa", spread=SPREAD)
            if f"p_{i}" in read:
                room >> De(f"p_{i}", unit="Pa")
        for a, b in ((1, 2), (2, 3)):
            through = One(f"pipe_{a}{b}")
            rooms[a - 1] >> through >> rooms[b - 1]
            through >> R(f"R_{a}{b}", pipe, unit="Pa*s/m3", spread=SPREAD)
        rooms[2] >> R("R_out", outlet, unit="Pa*s/m3", spread=SPREAD)
    return g
