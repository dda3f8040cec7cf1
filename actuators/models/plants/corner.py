"""A corner of a vehicle: road, tyre, wheel, suspension, body."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import BondGraph, C, Df, Dq, I, One, R, Sf, Zero


def corner() -> BondGraph:
    """Return a corner of a vehicle: road, tyre, wheel, suspension, body.

    v_r - k_t, b_t - m_u - k_s, b_s - m_b.

    Measured are the vertical speeds of wheel and body and the compression of the suspension.
    """
    with BondGraph("corner") as g:
        patch, squash, hub = Zero("patch"), One("squash"), One("wheel")
        seat, travel, sprung = Zero("seat"), One("travel"), One("body")
        Sf("v_r", unit="m/s") >> patch >> squash
        squash >> C("k_t", stiffness=1.8e5, unit="N/m", spread=SPREAD)
        squash >> R("b_t", 150.0, unit="N*s/m", spread=SPREAD)
        patch >> hub >> I("m_u", 40.0, unit="kg", spread=SPREAD)
        hub >> seat >> travel
        travel >> C("k_s", stiffness=2e4, unit="N/m", spread=SPREAD)
        travel >> R("b_s", 1200.0, unit="N*s/m", spread=SPREAD)
        seat >> sprung >> I("m_b", 300.0, unit="kg", spread=SPREAD)
        hub >> Df("v_u", unit="m/s")
        sprung >> Df("v_b", unit="m/s")
        travel >> Dq("s_d", unit="m")
    return g
