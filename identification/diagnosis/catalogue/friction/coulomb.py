"""Dry friction of constant level."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Coulomb
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.friction.forms import FRICTION_FORMS, friction_forms
from identification.diagnosis.catalogue.places import mechanical_resistors
from identification.diagnosis.catalogue.starts import at_least, rebalanced, rubbing_units
from identification.diagnosis.screening.port_history import FittedModel


class CoulombFriction(Effect):
    """Dry friction of constant level."""

    name = "coulomb_friction"
    family = "friction"
    kind = "dissipative"
    law = "coulomb"
    sentence = "a force of constant size opposes every motion and holds at rest"
    looks = (
        "flat tops where the motion turns, an error of the same size at small and large "
        "amplitude, a step of the force with every change of direction"
    )
    confused_with = ("stribeck_friction", "presliding_friction", "hysteresis")
    separated_by = (
        "constant slow speeds in both directions and a reversal within the slip length: Coulomb "
        "friction has one level and no spring before it slides"
    )
    source = "Coulomb 1785; Moreau 1988 for the implicit step"
    where = staticmethod(mechanical_resistors)
    richer = FRICTION_FORMS
    forms = staticmethod(friction_forms)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Direction of the flow."""
        return (Signature(np.sign(scene.of(element).argument)[:, None]),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Coulomb law beside the viscous one."""
        force = at_least(scene.of(element).swing, 1e-12)
        law = Coulomb(0.3 * force, unit=rubbing_units(element)[0])
        graph, (name,) = self.with_law(scene, element, law)
        # along a bent nominal model the screening may see next to nothing of it
        levels = (0.3, 0.05 if hint is None else at_least(hint.weights[0] / force, 0.02))
        direction = np.sign(scene.of(element).argument)
        starts = tuple(
            {name: level * force, **share}
            for level in levels
            for share in (rebalanced(element, scene.of(element), level * force * direction), {})
        )
        return self.inserted(element, graph, starts, (name,))
