"""Three masses between a wall and each other, with equal springs and dampers."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import BondGraph, C, Dq, I, One, R, Se, Zero


def chain() -> BondGraph:
    """Return three masses in a row on springs, one end at a wall.

    wall - k_1, b_1 - m_1 - k_2, b_2 - m_2 - k_3, b_3 - m_3, pushed at ``m_1`` by ``F``.

    Displacements of all three are measured.
    """
    with BondGraph("chain") as g:
        bodies = [One(f"body_{i}") for i in (1, 2, 3)]
        Se("F", unit="N") >> bodies[0]
        for i, body in enumerate(bodies, start=1):
            link = body
            if i > 1:
                joint, link = Zero(f"joint_{i}"), One(f"link_{i}")
                bodies[i - 2] >> joint >> body
                joint >> link
            body >> I(f"m_{i}", 1.0, unit="kg", spread=SPREAD)
            link >> C(f"k_{i}", stiffness=1e4, unit="N/m", spread=SPREAD)
            link >> R(f"b_{i}", 8.0, unit="N*s/m", spread=SPREAD)
            body >> Dq(f"x_{i}", unit="m")
    return g
