"""Two masses on springs, seen by accelerometers and by the load cell at the wall."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import wanted
from actuators.models.plants.two_masses import SprungMass, two_masses
from bondgraph import BondGraph, Da, Reading, effort

SENSORS = ("a_1", "a_2", "f_1")


def frame(sensors: Sequence[str] | None = None) -> BondGraph:
    """Return two masses on springs, seen by accelerometers and by a load cell at the wall.

    wall - k_1, b_1 - m_1 - k_2, b_2 - m_2, pushed at ``m_1`` by ``F``.

    Parameters
    ----------
    sensors : sequence of {"a_1", "a_2", "f_1"}, optional
        Accelerations (m/s^2) and the force that reaches the wall (N).
    """
    read = wanted("frame", SENSORS, sensors)
    with BondGraph("frame") as g:
        near, far = two_masses(g, SprungMass(2.0, 3e4, 25.0), SprungMass(1.0, 1.2e4, 8.0))
        if "a_1" in read:
            near >> Da("a_1", unit="m/s^2")
        if "a_2" in read:
            far >> Da("a_2", unit="m/s^2")
        if "f_1" in read:
            Reading("f_1", effort("k_1") + effort("b_1"), unit="N")
    return g
