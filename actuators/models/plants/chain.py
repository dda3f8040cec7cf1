"""Three masses between a wall and each other, with equal springs and dampers."""

from __future__ import annotations

from collections.abc import Sequence

from actuators.models.plants.sensors import SPREAD, wanted
from bondgraph import BondGraph, C, Dq, I, One, R, Se, Zero

SENSORS = ("x_1", "x_2", "x_3")


def chain(
    sensors: Sequence[str] | None = None,
    *,
    mass: float = 1.0,
    stiffness: float = 1e4,
    damping: float = 8.0,
) -> BondGraph:
    """Return three masses in a row on springs, one end at a wall.

    wall - k_1, b_1 - m_1 - k_2, b_2 - m_2 - k_3, b_3 - m_3, pushed at ``m_1`` by ``F``.

    Parameters
    ----------
    sensors : sequence of {"x_1", "x_2", "x_3"}, optional
        Displacements that are measured, m.
    mass, stiffness, damping : float
        Nominal values of all three, kg, N/m and N s/m.
    """
    read = wanted("chain", SENSORS, sensors)
    with BondGraph("chain") as g:
        bodies = [One(f"body_{i}") for i in (1, 2, 3)]
        Se("F", unit="N") >> bodies[0]
        for i, body in enumerate(bodies, start=1):
            link = body
            if i > 1:
                joint, link = Zero(f"joint_{i}"), One(f"link_{i}")
                bodies[i - 2] >> joint >> body
                joint >> link
            body >> I(f"m_{i}", mass, unit="kg", spread=SPREAD)
            link >> C(f"k_{i}", stiffness=stiffness, unit="N/m", spread=SPREAD)
            link >> R(f"b_{i}", damping, unit="N*s/m", spread=SPREAD)
            if f"x_{i}" in read:
                body >> Dq(f"x_{i}", unit="m")
    return g
