"""A reading that loses the sign."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws.rectifier import Rectifier
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.signal_traces import reading_without_offset, weight_of
from identification.diagnosis.screening.port_history import FittedModel


class SensorRectification(Effect):
    """The sensor gives the size of the signal without its sign, wholly or in part.

    A nominal model that was fitted to a rectified reading may have lost its gain, and then the
    linear screening sees little; the start at full rectification does not depend on it.
    """

    name = "sensor_rectification"
    family = "measurement"
    kind = "sensing"
    law = "rectifier"
    sentence = "its reading loses the sign of what it measures"
    looks = "the reading turns back at zero with a corner, at twice the frequency of the motion"
    confused_with = ("sensor_nonlinearity", "asymmetric_damping", "bilinear_stiffness")
    separated_by = "a slow motion through zero: a rectified reading turns back there"
    source = "full-wave rectifier, |s|"
    where = staticmethod(sensors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what is turned over; nothing where the reading keeps its sign."""
        y = reading_without_offset(scene, element)
        return (Signature.of((np.abs(y) - y,)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Rectification in full and as the signature weighs it."""
        law = Rectifier()
        graph, (amount,) = self.with_law(scene, element, law)
        found = [0.5, 1.0] if hint is None else [weight_of(hint, 0, 0.02, 1.0), 1.0]
        starts = tuple({amount: a} for a in dict.fromkeys(found))
        return self.inserted(element, graph, starts, (amount,))
