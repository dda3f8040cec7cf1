"""A linear motor that moves a carriage with a payload on an elastic coupling."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import GY, BondGraph, C, Da, Df, Dq, I, One, R, Se, Zero


def table() -> BondGraph:
    """Return a linear motor that moves a carriage with a payload on an elastic coupling.

    u - R_w, L_w - K_f - m_1, b_1 - k_c, b_c - m_2, b_2.

    Measured are the current, the position of the carriage and the acceleration of the payload.
    """
    with BondGraph("table") as g:
        winding, carriage, payload = One("winding"), One("carriage"), One("payload")
        joint, link = Zero("joint"), One("link")
        Se("u", unit="V") >> winding >> R("R_w", 3.0, unit="ohm", spread=SPREAD)
        winding >> I("L_w", 3e-3, unit="H", spread=SPREAD)
        winding >> GY("K_f", ratio=12.0, unit="N/A", spread=SPREAD) >> carriage
        carriage >> I("m_1", 2.5, unit="kg", spread=SPREAD)
        carriage >> R("b_1", 20.0, unit="N*s/m", spread=SPREAD)
        carriage >> joint >> payload
        joint >> link >> C("k_c", stiffness=4e4, unit="N/m", spread=SPREAD)
        link >> R("b_c", 15.0, unit="N*s/m", spread=SPREAD)
        payload >> I("m_2", 1.2, unit="kg", spread=SPREAD)
        payload >> R("b_2", 5.0, unit="N*s/m", spread=SPREAD)
        winding >> Df("i", unit="A")
        carriage >> Dq("x_1", unit="m")
        payload >> Da("a_2", unit="m/s^2")
    return g
