"""A resistor whose characteristic bends."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import NonlinearResistance
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import (
    electrical_resistors,
    has_unit,
    hydraulic_resistors,
    other_resistors,
)
from identification.diagnosis.catalogue.starts import rebalanced, tamed
from identification.diagnosis.screening.port_history import FittedModel, PortHistory


class NonlinearResistanceEffect(Effect):
    """Effort that is no straight line of the flow."""

    name = "nonlinear_resistance"
    family = "flow"
    kind = "dissipative"
    law = "cubic_characteristic"
    sentence = "its effort bends away from the straight line as more flows"
    looks = "effort over flow is one curve, the same at every speed and with no loop"
    confused_with = ("square_root_flow", "self_heating", "saturation", "diode")
    separated_by = (
        "steady flow at several levels, each held short and long: a bent characteristic answers "
        "at once, heat takes its time"
    )
    source = "series of a characteristic through the origin; Chua, IEEE Trans. Circuit Theory 1969"
    where = staticmethod(other_resistors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Square and cube of the scaled flow."""
        past = scene.of(element)
        z = past.argument / _level(past)
        return (Signature(np.stack([z**2, z**3], axis=1)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Quadratic and cubic term."""
        past = scene.of(element)
        effort, flow = "K", "W"
        if element in electrical_resistors(scene.graph):
            unit = getattr(element, "unit", "")
            effort, flow = "V", "A" if has_unit(element, ("ohm",)) else f"V/({unit})"
        elif element in hydraulic_resistors(scene.graph):
            effort, flow = "Pa", "m3/s"
        size = float(np.abs(past.output).max()) or 1.0
        law = NonlinearResistance(0.1 * size, _level(past), effort, flow)
        graph, names = self.with_law(scene, element, law)
        starts: tuple[dict[str, float], ...] = ({},)
        if hint is not None:
            weights = tamed(hint.weights, size)
            start = {n: float(w) for n, w in zip(names, weights, strict=True)}
            z = past.argument / _level(past)
            added = np.stack([z**2, z**3], axis=1) @ weights
            starts = ({**start, **rebalanced(element, past, added)}, start)
        return self.inserted(element, graph, starts, names)


def _level(past: PortHistory) -> float:
    return float(np.abs(past.argument).max()) or 1.0
