"""Two masses on springs, the first at a wall: what frame and press are built on."""

from __future__ import annotations

from dataclasses import dataclass

from actuators.models.plants.spread import SPREAD
from bondgraph import BondGraph, C, I, One, R, Se, Zero
from bondgraph.graph.elements import Junction
from bondgraph.laws.law import Law


@dataclass(frozen=True, slots=True)
class SprungMass:
    """Values of a mass and of the spring and damper before it; kg, N/m, N s/m."""

    mass: float
    stiffness: float
    damping: float


def two_masses(
    g: BondGraph, near: SprungMass, far: SprungMass, law: Law | None = None
) -> list[Junction]:
    """Add wall - k_1, b_1 - m_1 - k_2, b_2 - m_2, pushed at ``m_1`` by ``F``.

    Parameters
    ----------
    g : BondGraph
        A graph that is being built.
    law : Law, optional
        Of ``k_1``.

    Returns
    -------
    list of Junction
        The two masses' 1-junctions.
    """
    bodies: list[Junction] = [One("near"), One("far")]
    joint, link = Zero("joint"), One("link")
    Se("F", unit="N") >> bodies[0] >> joint >> bodies[1]
    joint >> link
    for i, (pair, body, spring, bent) in enumerate(
        ((near, bodies[0], bodies[0], law), (far, bodies[1], link, None)), start=1
    ):
        body >> I(f"m_{i}", pair.mass, unit="kg", spread=SPREAD)
        spring >> C(f"k_{i}", stiffness=pair.stiffness, unit="N/m", spread=SPREAD, law=bent)
        spring >> R(f"b_{i}", pair.damping, unit="N*s/m", spread=SPREAD)
    return bodies
