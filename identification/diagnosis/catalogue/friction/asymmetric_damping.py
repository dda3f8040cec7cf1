"""Damping that differs between the two directions."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import AsymmetricDamping
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import mechanical_resistors
from identification.diagnosis.screening.port_history import FittedModel


class AsymmetricDampingEffect(Effect):
    """Damping that differs between the two directions."""

    name = "asymmetric_damping"
    family = "friction"
    kind = "dissipative"
    law = "asymmetric_damping"
    sentence = "it damps one direction of motion more than the other"
    looks = "even harmonics and a shift of the mean that grow in proportion to the amplitude"
    confused_with = ("bilinear_stiffness", "quadratic_drag")
    separated_by = (
        "the same sine at two frequencies: the shift of the mean grows with the speed if it is the "
        "damper and stays if it is the spring"
    )
    source = "Dixon, The Shock Absorber Handbook, 2nd ed. 2007 (rebound and compression)"
    where = staticmethod(mechanical_resistors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """``|f|``."""
        return (Signature(np.abs(scene.of(element).argument)[:, None]),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Half the difference of both coefficients beside their mean."""
        past = scene.of(element)
        size = past.slope
        law = AsymmetricDamping(0.0, 0.3 * size, getattr(element, "unit", "") or "N*s/m")
        graph, (name,) = self.with_law(scene, element, law)
        tried = [0.2 * size, -0.2 * size]
        if hint is not None:  # beyond the mean one of the two coefficients would be negative
            tried = [float(np.clip(hint.weights[0], -0.9 * size, 0.9 * size))]
        return self.inserted(element, graph, tuple({name: v} for v in tried), (name,))
