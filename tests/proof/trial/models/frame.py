"""Two masses on springs, seen by accelerometers and by the load cell at the wall."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph import BondGraph, C, Da, I, One, R, Reading, Se, Zero, effort
from tests.proof.trial.models.sensors import SPREAD, wanted

SENSORS = ("a_1", "a_2", "f_1")


def frame(sensors: Sequence[str] | None = None) -> BondGraph:
    """Return wall - k_1, b_1 - m_1 - k_2, b_2 - m_2, pushed at ``m_1`` by ``F``.

    Parameters
    ----------
    sensors : sequence of {"a_1", "a_2", "f_1"}, optional
        Accelerations (m/s^2) and the force that reaches the wall (N).
    """
    read = wanted("frame", SENSORS, sensors)
    with BondGraph("frame") as g:
        near, far = One("near"), One("far")
        joint, link = Zero("joint"), One("link")
        Se("F", unit="N") >> near >> joint >> far
        joint >> link
        near >> I("m_1", 2.0, unit="kg", spread=SPREAD)
        near >> C("k_1", stiffness=3e4, unit="N/m", spread=SPREAD)
        near >> R("b_1", 25.0, unit="N*s/m", spread=SPREAD)
        far >> I("m_2", 1.0, unit="kg", spread=SPREAD)
        link >> C("k_2", stiffness=1.2e4, unit="N/m", spread=SPREAD)
        link >> R("b_2", 8.0, unit="N*s/m", spread=SPREAD)
        if "a_1" in read:
            near >> Da("a_1", unit="m/s^2")
        if "a_2" in read:
            far >> Da("a_2", unit="m/s^2")
        if "f_1" in read:
            Reading("f_1", effort("k_1") + effort("b_1"), unit="N")
    return g
