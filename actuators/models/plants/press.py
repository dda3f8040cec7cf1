"""Two masses, the first on a spring that is known to harden; displacement, acceleration, force."""

from __future__ import annotations

from actuators.models.plants.two_masses import SprungMass, two_masses
from bondgraph import BondGraph, Da, Dq, Reading, effort
from bondgraph.laws.polynomial import Polynomial


def press() -> BondGraph:
    """Return two masses on springs of which the first is known to harden.

    wall - k_1 (hardening), b_1 - m_1 - k_2, b_2 - m_2, pushed at ``m_1`` by ``F``.

    Measured are displacement, acceleration and the force in ``k_2`` and ``b_2``.
    """
    hardening = Polynomial(half=1e-3, size=0.2, orders=(3,), unit="N")
    with BondGraph("press") as g:
        near, far = two_masses(g, SprungMass(5.0, 8e4, 60.0), SprungMass(2.0, 5e4, 30.0), hardening)
        near >> Dq("x_1", unit="m")
        far >> Da("a_2", unit="m/s^2")
        Reading("f_2", effort("k_2") + effort("b_2"), unit="N")
    return g.with_values({"a_3_k_1": 0.2})
