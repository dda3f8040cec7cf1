"""A hydraulic cylinder that moves a mass; nothing holds its position."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import TF, BondGraph, C, De, Dq, I, One, R, Sf, Zero


def cylinder() -> BondGraph:
    """Return a hydraulic cylinder that moves a mass; nothing holds its position.

    q_v - C_h, R_l - A - m, b.

    Measured are the pressure of the chamber and the position of the piston. The piston turns
    pressure into the force ``A p``, ``A`` in m^2; the ratio of the transformer is its inverse.
    """
    with BondGraph("cylinder") as g:
        room, body = Zero("chamber"), One("piston")
        Sf("q_v", unit="m3/s") >> room >> C("C_h", 4e-13, unit="m3/Pa", spread=SPREAD)
        room >> R("R_l", 1.5e10, unit="Pa*s/m3", spread=SPREAD)
        room >> TF("A", ratio=1.0 / 1e-3, unit="1/m2", spread=SPREAD) >> body
        body >> I("m", 20.0, unit="kg", spread=SPREAD)
        body >> R("b", 600.0, unit="N*s/m", spread=SPREAD)
        room >> De("p", unit="Pa")
        body >> Dq("x", unit="m")
    return g
