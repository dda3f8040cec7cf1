"""A DC motor that turns a load through a gear and an elastic shaft."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import GY, TF, BondGraph, C, Df, I, One, R, Se, Zero


def motor() -> BondGraph:
    """Return a DC motor that turns a load through a gear and an elastic shaft.

    u - R_w, L_w - K_m - J_1, b_1 - gear n - k_s, b_s - J_2, b_2.

    Measured are the current and the speeds of rotor and load. The gear is ``w_1`` over the speed
    behind it; the ratio of the transformer is its inverse.
    """
    with BondGraph("motor") as g:
        winding, rotor_speed, behind = One("winding"), One("rotor"), Zero("behind_gear")
        twist, load_speed = One("twist"), One("load")
        Se("u", unit="V") >> winding >> R("R_w", 2.0, unit="ohm", spread=SPREAD)
        winding >> I("L_w", 2e-3, unit="H", spread=SPREAD)
        winding >> GY("K_m", ratio=0.05, unit="V*s/rad", spread=SPREAD) >> rotor_speed
        rotor_speed >> I("J_1", 5e-5, unit="kg*m2", spread=SPREAD)
        rotor_speed >> R("b_1", 1e-4, unit="N*m*s/rad", spread=SPREAD)
        rotor_speed >> TF("n", ratio=1.0 / 5.0, spread=SPREAD) >> behind
        behind >> twist >> C("k_s", stiffness=10.0, unit="N*m/rad", spread=SPREAD)
        twist >> R("b_s", 4e-3, unit="N*m*s/rad", spread=SPREAD)
        behind >> load_speed >> I("J_2", 1e-3, unit="kg*m2", spread=SPREAD)
        load_speed >> R("b_2", 2e-3, unit="N*m*s/rad", spread=SPREAD)
        winding >> Df("i", unit="A")
        rotor_speed >> Df("w_1", unit="rad/s")
        load_speed >> Df("w_2", unit="rad/s")
    return g
