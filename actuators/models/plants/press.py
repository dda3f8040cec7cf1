"""Two masses, the first on a spring that is known to harden; displacement, acceleration, force."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import wanted
from actuators.models.plants.two_masses import SprungMass, two_masses
from bondgraph import BondGraph, Da, Dq, Reading, effort
from bondgraph.laws.polynomial import Polynomial

SENSORS = ("x_1", "a_2", "f_2")


def press(sensors: Sequence[str] | None = None) -> BondGraph:
    """Return two masses on springs of which the first is known to harden.

    wall - k_1 (hardening), b_1 - m_1 - k_2, b_2 - m_2, pushed at ``m_1`` by ``F``.

    Parameters
    ----------
    sensors : sequence of {"x_1", "a_2", "f_2"}, optional
        Displacement (m), acceleration (m/s^2) and the force in ``k_2`` and ``b_2`` (N).
    """
    read = wanted("press", SENSORS, sensors)
    hardening = Polynomial(half=1e-3, size=0.2, orders=(3,), unit="N")
    with BondGraph("press") as g:
        near, far = two_masses(g, SprungMass(5.0, 8e4, 60.0), SprungMass(2.0, 5e4, 30.0), hardening)
        if "x_1" in read:
            near >> Dq("x_1", unit="m")
        if "a_2" in read:
            far >> Da("a_2", unit="m/s^2")
        if "f_2" in read:
            Reading("f_2", effort("k_2") + effort("b_2"), unit="N")
    return g.with_values({"a_3_k_1": 0.2})
