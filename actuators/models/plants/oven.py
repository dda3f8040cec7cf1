"""A heater, the chamber around it, and what escapes; effort is temperature, flow is heat flow."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import SPREAD, wanted
from bondgraph import BondGraph, C, De, One, R, Sf, Zero

SENSORS = ("T_1", "T_2")


def oven(
    sensors: Sequence[str] | None = None,
    *,
    heater: float = 400.0,
    between: float = 0.2,
    chamber: float = 1500.0,
    outside: float = 0.5,
) -> BondGraph:
    """Return a heater, its chamber, what escapes to the room; temperatures are above the room's.

    P - C_1 - R_12 - C_2 - R_out. A recording may count temperatures from elsewhere (degC, K): a
    constant room is the offset of the readings, which fits take along.

    Parameters
    ----------
    sensors : sequence of {"T_1", "T_2"}, optional
        Temperatures of heater and chamber above the room, K.
    """
    read = wanted("oven", SENSORS, sensors)
    with BondGraph("oven") as g:
        rooms = [Zero("heater"), Zero("chamber")]
        Sf("P", unit="W") >> rooms[0] >> C("C_1", heater, unit="J/K", spread=SPREAD)
        through = One("wall")
        rooms[0] >> through >> rooms[1]
        through >> R("R_12", between, unit="K/W", spread=SPREAD)
        rooms[1] >> C("C_2", chamber, unit="J/K", spread=SPREAD)
        rooms[1] >> R("R_out", outside, unit="K/W", spread=SPREAD)
        for i, room in enumerate(rooms, start=1):
            if f"T_{i}" in read:
                room >> De(f"T_{i}", unit="K")
    return g
