"""Force that grows with the square of the speed."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import QuadraticDrag
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import mechanical_resistors
from identification.diagnosis.catalogue.starts import at_least, rebalanced, rubbing_units
from identification.diagnosis.screening.port_history import FittedModel


class Drag(Effect):
    """Force that grows with the square of the speed."""

    name = "quadratic_drag"
    family = "friction"
    kind = "dissipative"
    law = "quadratic_drag"
    sentence = "a force that grows with the square of the speed opposes the motion"
    looks = "peaks at high speed are too low, slow motion is right; damping grows with amplitude"
    confused_with = ("coulomb_friction", "asymmetric_damping")
    separated_by = "free decay or steady speeds from slow to fast: damping grows with the speed"
    source = "Newton's drag law; Batchelor, An Introduction to Fluid Dynamics, section 5.11"
    where = staticmethod(mechanical_resistors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """``|f| f``."""
        f = scene.of(element).argument
        return (Signature((np.abs(f) * f)[:, None]),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Quadratic law beside the viscous one."""
        past = scene.of(element)
        full = past.swing / past.half**2
        effort, _, way = rubbing_units(element)
        law = QuadraticDrag(0.2 * full, f"{effort}*s2/{way}2")
        graph, (name,) = self.with_law(scene, element, law)
        start = 0.2 * full if hint is None else at_least(hint.weights[0], 0.02 * full)
        added = start * np.abs(past.argument) * past.argument
        starts = ({name: start, **rebalanced(element, past, added)}, {name: start})
        return self.inserted(element, graph, starts, (name,))
