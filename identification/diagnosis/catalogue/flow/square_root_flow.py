"""Turbulent flow through an orifice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.laws import Law, QuadraticDrag
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import hydraulic_resistors
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.catalogue.starts import at_least
from identification.diagnosis.screening.port_history import PortHistory


class SquareRootFlow(Effect):
    """Flow with the square root of the pressure: pressure with the square of the flow."""

    name = "square_root_flow"
    family = "flow"
    kind = "dissipative"
    law = "quadratic_pressure_drop"
    laws = (QuadraticDrag,)
    sentence = "its flow grows with the square root of the pressure, as through an orifice"
    looks = "emptying slows down in a parabola that ends, not in an exponential that does not"
    confused_with = ("nonlinear_resistance", "nonlinear_stiffness")
    separated_by = "steady flow at four times the pressure: twice the flow, not four times"
    source = "Torricelli 1643; Merritt, Hydraulic Control Systems, 1967 (orifice)"
    where = staticmethod(hydraulic_resistors)

    weights = ("c_2",)

    def made(self, at: Site) -> Law:
        """Quadratic pressure drop beside the linear one, which the fit may make small."""
        unit = "s2/m5" if at.units[0] == "m" else "Pa*s2/m6"
        return QuadraticDrag(0.5 * _full(at.past), unit)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return a large part of the whole drop beside what the hint says."""
        full = _full(at.past)
        seen = (0.5 * full, 0.9 * full)
        if hint is not None:
            seen = (at_least(hint.weights[0], 0.02 * full), 0.8 * full)
        return [{"c_2": v} for v in seen]


def _full(past: PortHistory) -> float:
    """Return the coefficient that makes the whole drop at the largest flow."""
    return float(np.abs(past.output).max() or past.swing) / past.largest**2
