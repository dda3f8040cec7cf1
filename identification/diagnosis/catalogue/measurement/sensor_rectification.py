"""A reading that loses the sign."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element
from bondgraph.laws.rectifier import Rectifier
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature, sensors
from identification.diagnosis.catalogue.signal_traces import (
    reading_without_offset,
    weighed,
    weight_of,
)
from identification.diagnosis.screening.port_history import FittedModel


class SensorRectification(Effect):
    """The sensor gives the size of the signal without its sign, wholly or in part.

    A nominal model that was fitted to a rectified reading may have lost its gain, and then the
    linear screening sees little; the start at full rectification does not depend on it.
    """

    name = "sensor_rectification"
    family = "measurement"
    law = "rectifier"
    sentence = "its reading loses the sign of what it measures"
    looks = "the reading turns back at zero with a corner, at twice the frequency of the motion"
    confused_with = ("sensor_nonlinearity", "asymmetric_damping", "bilinear_stiffness")
    separated_by = "a slow motion through zero: a rectified reading turns back there"
    source = "full-wave rectifier, |s|"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Sensors."""
        return sensors(graph)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what is turned over; nothing where the reading keeps its sign."""
        y = reading_without_offset(scene, element)
        return (weighed((np.abs(y) - y,)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Rectification in full and as the signature weighs it."""
        law = Rectifier()
        (amount,) = (p.name for p in law.parameters(element.name))
        graph = scene.graph.with_element(element.name, law=law)
        found = [0.5, 1.0] if hint is None else [weight_of(hint, 0, 0.02, 1.0), 1.0]
        starts = tuple({amount: a} for a in dict.fromkeys(found))
        return self.inserted(element, graph, starts, (amount,))
