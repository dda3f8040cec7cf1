"""A corner of a vehicle: road, tyre, wheel, suspension, body."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import SPREAD, wanted
from bondgraph import BondGraph, C, Df, Dq, I, One, R, Sf, Zero

SENSORS = ("v_u", "v_b", "s_d")


def corner(
    sensors: Sequence[str] | None = None,
    *,
    tyre: float = 1.8e5,
    tyre_damping: float = 150.0,
    wheel: float = 40.0,
    spring: float = 2e4,
    damper: float = 1200.0,
    body: float = 300.0,
) -> BondGraph:
    """Return a corner of a vehicle: road, tyre, wheel, suspension, body.

    v_r - k_t, b_t - m_u - k_s, b_s - m_b.

    Parameters
    ----------
    sensors : sequence of {"v_u", "v_b", "s_d"}, optional
        Vertical speeds of wheel and body (m/s), compression of the suspension (m).
    """
    read = wanted("corner", SENSORS, sensors)
    with BondGraph("corner") as g:
        patch, squash, hub = Zero("patch"), One("squash"), One("wheel")
        seat, travel, sprung = Zero("seat"), One("travel"), One("body")
        Sf("v_r", unit="m/s") >> patch >> squash
        squash >> C("k_t", stiffness=tyre, unit="N/m", spread=SPREAD)
        squash >> R("b_t", tyre_damping, unit="N*s/m", spread=SPREAD)
        patch >> hub >> I("m_u", wheel, unit="kg", spread=SPREAD)
        hub >> seat >> travel
        travel >> C("k_s", stiffness=spring, unit="N/m", spread=SPREAD)
        travel >> R("b_s", damper, unit="N*s/m", spread=SPREAD)
        seat >> sprung >> I("m_b", body, unit="kg", spread=SPREAD)
        if "v_u" in read:
            hub >> Df("v_u", unit="m/s")
        if "v_b" in read:
            sprung >> Df("v_b", unit="m/s")
        if "s_d" in read:
            travel >> Dq("s_d", unit="m")
    return g
