"""Two masses on springs, seen by accelerometers and by the load cell at the wall."""

from __future__ import annotations

from actuators.models.plants.two_masses import SprungMass, two_masses
from bondgraph import BondGraph, Da, Reading, effort


def frame() -> BondGraph:
    """Return two masses on springs, seen by accelerometers and by a load cell at the wall.

    wall - k_1, b_1 - m_1 - k_2, b_2 - m_2, pushed at ``m_1`` by ``F``.

    Measured are both accelerations and the force that reaches the wall.
    """
    with BondGraph("frame") as g:
        near, far = two_masses(g, SprungMass(2.0, 3e4, 25.0), SprungMass(1.0, 1.2e4, 8.0))
        near >> Da("a_1", unit="m/s^2")
        far >> Da("a_2", unit="m/s^2")
        Reading("f_1", effort("k_1") + effort("b_1"), unit="N")
    return g
