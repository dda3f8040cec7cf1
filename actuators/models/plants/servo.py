"""A motor under current control that turns a load through an elastic coupling."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import SPREAD, wanted
from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se, Zero

SENSORS = ("a_1", "w_2")


def servo(
    sensors: Sequence[str] | None = None,
    *,
    rotor: float = 2e-4,
    rotor_damping: float = 2e-3,
    coupling: float = 40.0,
    coupling_damping: float = 8e-3,
    load: float = 6e-4,
    load_damping: float = 3e-3,
) -> BondGraph:
    """Return a motor under current control that turns a load through an elastic coupling.

    T_m - J_1, b_1 - k_c, b_c - J_2, b_2.

    Parameters
    ----------
    sensors : sequence of {"a_1", "w_2"}, optional
        Angle of the rotor (rad), speed of the load (rad/s).
    """
    read = wanted("servo", SENSORS, sensors)
    with BondGraph("servo") as g:
        rotor_speed, joint = One("rotor"), Zero("joint")
        twist, load_speed = One("twist"), One("load")
        Se("T_m", unit="N*m") >> rotor_speed >> I("J_1", rotor, unit="kg*m2", spread=SPREAD)
        rotor_speed >> R("b_1", rotor_damping, unit="N*m*s/rad", spread=SPREAD)
        rotor_speed >> joint >> load_speed
        joint >> twist >> C("k_c", stiffness=coupling, unit="N*m/rad", spread=SPREAD)
        twist >> R("b_c", coupling_damping, unit="N*m*s/rad", spread=SPREAD)
        load_speed >> I("J_2", load, unit="kg*m2", spread=SPREAD)
        load_speed >> R("b_2", load_damping, unit="N*m*s/rad", spread=SPREAD)
        if "a_1" in read:
            rotor_speed >> Dq("a_1", unit="rad")
        if "w_2" in read:
            load_speed >> Df("w_2", unit="rad/s")
    return g
