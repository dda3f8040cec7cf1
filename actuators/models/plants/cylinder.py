"""A hydraulic cylinder that moves a mass; nothing holds its position."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import SPREAD, wanted
from bondgraph import TF, BondGraph, C, De, Dq, I, One, R, Sf, Zero

SENSORS = ("p", "x")


def cylinder(
    sensors: Sequence[str] | None = None,
    *,
    chamber: float = 4e-13,
    leak: float = 1.5e10,
    area: float = 1e-3,
    mass: float = 20.0,
    damping: float = 600.0,
) -> BondGraph:
    """Return a hydraulic cylinder that moves a mass; nothing holds its position.

    q_v - C_h, R_l - A - m, b.

    Parameters
    ----------
    sensors : sequence of {"p", "x"}, optional
        Pressure of the chamber (Pa) and position of the piston (m).
    area : float
        ``A``, m^2: force ``A p``, flow ``A dx/dt``; the ratio of the transformer is its inverse.
    """
    read = wanted("cylinder", SENSORS, sensors)
    with BondGraph("cylinder") as g:
        room, body = Zero("chamber"), One("piston")
        Sf("q_v", unit="m3/s") >> room >> C("C_h", chamber, unit="m3/Pa", spread=SPREAD)
        room >> R("R_l", leak, unit="Pa*s/m3", spread=SPREAD)
        room >> TF("A", ratio=1.0 / area, unit="1/m2", spread=SPREAD) >> body
        body >> I("m", mass, unit="kg", spread=SPREAD)
        body >> R("b", damping, unit="N*s/m", spread=SPREAD)
        if "p" in read:
            room >> De("p", unit="Pa")
        if "x" in read:
            body >> Dq("x", unit="m")
    return g
