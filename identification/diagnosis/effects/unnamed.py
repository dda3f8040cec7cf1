"""A curve without a name at every port: what locates when no name fits."""

from __future__ import annotations

import numpy as np

from bondgraph.drives import Drive
from bondgraph.elements import Element, Source
from bondgraph.graph import BondGraph
from bondgraph.laws import Hats
from identification.diagnosis.effects.effect import (
    Effect,
    Insertion,
    mechanical_resistors,
    sensors,
    sources,
    storages,
)
from identification.diagnosis.scene import Scene


class UnnamedCurve(Effect):
    """Any memoryless deviation as a function of the port's own variable."""

    name = "unknown"
    family = "outside"
    law = "piecewise_linear"
    sentence = "an unnamed function of its own variable would explain part of the misfit"
    source = "hat functions"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Every storage, resistor, source and sensor."""
        return (*storages(graph), *mechanical_resistors(graph), *sources(graph), *sensors(graph))

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Seven knots over the range of the record."""
        past = scene.of(element)
        knots = tuple(float(v) for v in past.centre + past.half * np.linspace(-1, 1, 7))
        law = Hats(knots, 0.05 * past.swing)
        names = tuple(p.name for p in law.parameters(element.name))
        if isinstance(element, Source):
            graph = scene.graph.with_element(element.name, drive=Drive(law=law))
        else:
            graph = scene.graph.with_element(element.name, law=law)
        return self.inserted(element, graph, ({},), names)
