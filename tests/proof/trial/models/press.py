"""Two masses, the first on a spring that is known to harden; displacement, acceleration, force."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph import BondGraph, C, Da, Dq, I, One, R, Reading, Se, Zero, effort
from bondgraph.laws.polynomial import Polynomial
from tests.proof.trial.models.sensors import SPREAD, wanted

SENSORS = ("x_1", "a_2", "f_2")


def press(sensors: Sequence[str] | None = None) -> BondGraph:
    """Return wall - k_1 (hardening), b_1 - m_1 - k_2, b_2 - m_2, pushed at ``m_1`` by ``F``.

    Parameters
    ----------
    sensors : sequence of {"x_1", "a_2", "f_2"}, optional
        Displacement (m), acceleration (m/s^2) and the force in ``k_2`` and ``b_2`` (N).
    """
    read = wanted("press", SENSORS, sensors)
    hardening = Polynomial(half=1e-3, size=0.2, orders=(3,), unit="N")
    with BondGraph("press") as g:
        near, far = One("near"), One("far")
        joint, link = Zero("joint"), One("link")
        Se("F", unit="N") >> near >> joint >> far
        joint >> link
        near >> I("m_1", 5.0, unit="kg", spread=SPREAD)
        near >> C("k_1", stiffness=8e4, unit="N/m", spread=SPREAD, law=hardening)
        near >> R("b_1", 60.0, unit="N*s/m", spread=SPREAD)
        far >> I("m_2", 2.0, unit="kg", spread=SPREAD)
        link >> C("k_2", stiffness=5e4, unit="N/m", spread=SPREAD)
        link >> R("b_2", 30.0, unit="N*s/m", spread=SPREAD)
        if "x_1" in read:
            near >> Dq("x_1", unit="m")
        if "a_2" in read:
            far >> Da("a_2", unit="m/s^2")
        if "f_2" in read:
            Reading("f_2", effort("k_2") + effort("b_2"), unit="N")
    return g.with_values({"a_3_k_1": 0.2})
