"""A motor under current control that turns a load through an elastic coupling."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se, Zero


def servo() -> BondGraph:
    """Return a motor under current control that turns a load through an elastic coupling.

    T_m - J_1, b_1 - k_c, b_c - J_2, b_2.

    Measured are the angle of the rotor and the speed of the load.
    """
    with BondGraph("servo") as g:
        rotor_speed, joint = One("rotor"), Zero("joint")
        twist, load_speed = One("twist"), One("load")
        Se("T_m", unit="N*m") >> rotor_speed >> I("J_1", 2e-4, unit="kg*m2", spread=SPREAD)
        rotor_speed >> R("b_1", 2e-3, unit="N*m*s/rad", spread=SPREAD)
        rotor_speed >> joint >> load_speed
        joint >> twist >> C("k_c", stiffness=40.0, unit="N*m/rad", spread=SPREAD)
        twist >> R("b_c", 8e-3, unit="N*m*s/rad", spread=SPREAD)
        load_speed >> I("J_2", 6e-4, unit="kg*m2", spread=SPREAD)
        load_speed >> R("b_2", 3e-3, unit="N*m*s/rad", spread=SPREAD)
        rotor_speed >> Dq("a_1", unit="rad")
        load_speed >> Df("w_2", unit="rad/s")
    return g
