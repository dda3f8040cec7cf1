"""A DC motor that turns a load through a gear and an elastic shaft."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import SPREAD, wanted
from bondgraph import GY, TF, BondGraph, C, Df, I, One, R, Se, Zero

SENSORS = ("i", "w_1", "w_2")


def motor(
    sensors: Sequence[str] | None = None,
    *,
    resistance: float = 2.0,
    inductance: float = 2e-3,
    constant: float = 0.05,
    rotor: float = 5e-5,
    rotor_damping: float = 1e-4,
    gear: float = 5.0,
    shaft: float = 10.0,
    shaft_damping: float = 4e-3,
    load: float = 1e-3,
    load_damping: float = 2e-3,
) -> BondGraph:
    """Return a DC motor that turns a load through a gear and an elastic shaft.

    u - R_w, L_w - K_m - J_1, b_1 - gear n - k_s, b_s - J_2, b_2.

    Parameters
    ----------
    sensors : sequence of {"i", "w_1", "w_2"}, optional
        Current (A), speeds of rotor and load (rad/s).
    gear : float
        ``w_1`` over the speed behind the gear; the ratio of the transformer is its inverse.
    """
    read = wanted("motor", SENSORS, sensors)
    with BondGraph("motor") as g:
        winding, rotor_speed, behind = One("winding"), One("rotor"), Zero("behind_gear")
        twist, load_speed = One("twist"), One("load")
        Se("u", unit="V") >> winding >> R("R_w", resistance, unit="ohm", spread=SPREAD)
        winding >> I("L_w", inductance, unit="H", spread=SPREAD)
        winding >> GY("K_m", ratio=constant, unit="V*s/rad", spread=SPREAD) >> rotor_speed
        rotor_speed >> I("J_1", rotor, unit="kg*m2", spread=SPREAD)
        rotor_speed >> R("b_1", rotor_damping, unit="N*m*s/rad", spread=SPREAD)
        rotor_speed >> TF("n", ratio=1.0 / gear, spread=SPREAD) >> behind
        behind >> twist >> C("k_s", stiffness=shaft, unit="N*m/rad", spread=SPREAD)
        twist >> R("b_s", shaft_damping, unit="N*m*s/rad", spread=SPREAD)
        behind >> load_speed >> I("J_2", load, unit="kg*m2", spread=SPREAD)
        load_speed >> R("b_2", load_damping, unit="N*m*s/rad", spread=SPREAD)
        if "i" in read:
            winding >> Df("i", unit="A")
        if "w_1" in read:
            rotor_speed >> Df("w_1", unit="rad/s")
        if "w_2" in read:
            load_speed >> Df("w_2", unit="rad/s")
    return g
