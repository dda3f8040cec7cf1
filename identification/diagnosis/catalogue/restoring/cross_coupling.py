"""Two masses that a spring or a damper joins which the model does not have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, One, R, Zero
from bondgraph.graph.parameter import Parameter, symbol
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import apart, masses
from identification.diagnosis.catalogue.starts import at_least, rubbing_units
from identification.diagnosis.screening.port_history import FittedModel, moved_by

SPRING, DAMPER = 0.0, 1.0
"""A force in proportion to the way between both masses, or to its rate."""


class CrossCoupling(Effect):
    """A force between two masses grows with the way between them, or with its rate.

    Of a pair the mass that was declared first is the place.
    """

    joins = True
    name = "cross_coupling"
    family = "restoring"
    kind = "restoring"
    law = "spring_between"
    sentence = "a spring or a damper joins it to another mass"
    looks = "one mass answers at the resonance of another that nothing joins it to"
    confused_with = ("added_mode", "asymmetric_damping", "nonlinear_stiffness")
    separated_by = (
        "hold one of both masses and push the other one: the force on the held one tells the "
        "spring when slow and the damper when fast"
    )
    source = "coupled oscillators; Den Hartog, Mechanical Vibrations, 1956"
    richer = ("damper_between",)
    meanings: ClassVar[Mapping[str, str]] = {
        "k_x": "stiffness between both masses",
        "d_x": "damping between both masses",
    }

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return the masses that have another one to be joined to."""
        return tuple(e for e in masses(graph) if partners(graph, e))

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Force on one mass and against the other one, by the way between them and by its rate."""
        past, found = scene.of(element), []
        for number, other in enumerate(partners(scene.graph, element)):
            rate = past.argument - scene.of(other).argument
            for way, force in ((SPRING, moved_by(rate, past.dt)), (DAMPER, rate)):
                shape, column = {"to": float(number), "way": way}, force[:, None]
                course, against = "damper" if way == DAMPER else "spring", (other.name, -column)
                found.append(Signature(column, None, shape, course, (against,)))
        return tuple(found)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a spring or a damper between both masses, whichever explained more."""
        g, past, shape = scene.graph, scene.of(element), dict(hint.shape) if hint else {}
        name, other = element.name, partners(g, element)[int(shape.get("to", 0))]
        rate = past.argument - scene.of(other).argument
        damps = shape.get("way") == DAMPER
        argument = rate if damps else moved_by(rate, past.dt)
        effort, _, moved = rubbing_units(element)
        unit, word = (f"{effort}*s/{moved}", "d_x") if damps else (f"{effort}/{moved}", "k_x")
        typical = 0.1 * past.swing / (float(np.ptp(argument)) or 1.0)
        size = at_least(float(hint.weights[0]) if hint is not None else 0.0, 0.1 * typical)
        amount = Parameter(f"{word}_{name}", size, unit, lower=0.0, scale=typical)
        value = symbol(amount.name, positive=True)
        law: C | R = R(f"R_x_{name}", value) if damps else C(f"C_x_{name}", stiffness=value)
        joint = Zero(f"joint_{name}")
        g = g.with_parameters([amount]).with_branch(g.neighbour(name), [joint])
        g = g.with_branch(joint.name, [law])
        g.bond(joint, g[g.neighbour(other.name)])
        made = self.inserted(
            element, g, ({amount.name: size}, {amount.name: 3 * size}), (amount.name,)
        )
        said = f"a {'damper' if damps else 'spring'} joins it to {other.name}"
        made = replace(made, sentence=said, joined=other.name)
        return replace(made, law=self.richer[0], kind="dissipative") if damps else made


def partners(graph: BondGraph, mass: Element) -> tuple[Element, ...]:
    """Return the masses that `mass` may be joined to, the nearest first."""
    return apart(graph, mass, masses(graph), One)
