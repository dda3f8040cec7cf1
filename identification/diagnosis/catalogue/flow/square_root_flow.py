"""Turbulent flow through an orifice."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import QuadraticDrag
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import hydraulic_resistors
from identification.diagnosis.catalogue.starts import at_least, rebalanced
from identification.diagnosis.screening.port_history import FittedModel


class SquareRootFlow(Effect):
    """Flow with the square root of the pressure: pressure with the square of the flow."""

    name = "square_root_flow"
    family = "flow"
    kind = "dissipative"
    law = "quadratic_pressure_drop"
    sentence = "its flow grows with the square root of the pressure, as through an orifice"
    looks = "emptying slows down in a parabola that ends, not in an exponential that does not"
    confused_with = ("nonlinear_resistance", "nonlinear_stiffness")
    separated_by = "steady flow at four times the pressure: twice the flow, not four times"
    source = "Torricelli 1643; Merritt, Hydraulic Control Systems, 1967 (orifice)"
    where = staticmethod(hydraulic_resistors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """``|f| f``; the linear part belongs to the resistor itself."""
        f = scene.of(element).argument
        return (Signature((np.abs(f) * f)[:, None]),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Quadratic pressure drop beside the linear one, which the fit may make small."""
        past = scene.of(element)
        largest = float(np.abs(past.argument).max()) or 1.0
        full = float(np.abs(past.output).max() or past.swing) / largest**2
        law = QuadraticDrag(0.5 * full, "Pa*s2/m6")
        graph, (name,) = self.with_law(scene, element, law)
        tried = [0.5 * full, 0.9 * full]
        if hint is not None:
            tried = [at_least(hint.weights[0], 0.02 * full), 0.8 * full]
        f = past.argument
        starts = tuple(
            {name: v, **share}
            for v in tried
            for share in (rebalanced(element, past, v * np.abs(f) * f), {})
        )
        return self.inserted(element, graph, starts, (name,))
