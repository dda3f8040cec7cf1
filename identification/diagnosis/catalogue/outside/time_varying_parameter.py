"""Time-varying parameter: a stiffness or a resistance that changes during the record."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, R
from bondgraph.laws import Ageing
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import storages
from identification.diagnosis.screening.port_history import FittedModel


class TimeVaryingParameter(Effect):
    """Slope of a storage or a resistor that drifts, linearly and with the square of time."""

    name = "time_varying_parameter"
    family = "outside"
    kind = "time"
    law = "ageing"
    sentence = "its value changes while the record lasts"
    looks = (
        "the same command gives another answer late in the record than early; each stretch alone "
        "is fitted well, with another value"
    )
    confused_with = ("nonlinear_stiffness", "sensor_drift", "creep", "self_heating")
    separated_by = (
        "the same excitation twice with a long pause, and once at half the amplitude: a drift "
        "changes between the two equal parts, a nonlinear law between the amplitudes"
    )
    source = "Taylor series of the parameter over time"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Storages and resistors of every domain."""
        return (*storages(graph), *(e for e in graph.of_type(R) if e.law is None))

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Argument times the time, and times its square, over the duration."""
        past = scene.of(element)
        t = past.time / _duration(scene)
        return (Signature(np.stack([past.argument * t, past.argument * t**2], axis=1)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Give the element a law whose slope drifts."""
        past = scene.of(element)
        law = Ageing(_duration(scene), 0.1 * past.slope, _slope_unit(element))
        graph, names = self.with_law(scene, element, law)
        starts = {} if hint is None else hint.by_name(names)
        return self.inserted(element, graph, (starts,), names)


def _duration(scene: FittedModel) -> float:
    return float(scene.data.dt * scene.data.n)


def _slope_unit(element: Element) -> str:
    unit = str(getattr(element, "unit", "")) or "1"
    return f"1/({unit})" if isinstance(element, C) and element.stiffness is None else unit
