"""A heater, the chamber around it, and what escapes; effort is temperature, flow is heat flow."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import BondGraph, C, De, One, R, Sf, Zero


def oven() -> BondGraph:
    """Return a heater, its chamber, what escapes to the room; temperatures are above the room's.

    P - C_1 - R_12 - C_2 - R_out. A recording may count temperatures from elsewhere (degC, K): a
    constant room is the offset of the readings, which fits take along.

    Measured are the temperatures of heater and chamber above the room.
    """
    with BondGraph("oven") as g:
        rooms = [Zero("heater"), Zero("chamber")]
        Sf("P", unit="W") >> rooms[0] >> C("C_1", 400.0, unit="J/K", spread=SPREAD)
        through = One("wall")
        rooms[0] >> through >> rooms[1]
        through >> R("R_12", 0.2, unit="K/W", spread=SPREAD)
        rooms[1] >> C("C_2", 1500.0, unit="J/K", spread=SPREAD)
        rooms[1] >> R("R_out", 0.5, unit="K/W", spread=SPREAD)
        for i, room in enumerate(rooms, start=1):
            room >> De(f"T_{i}", unit="K")
    return g
