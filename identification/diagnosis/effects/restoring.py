"""Effects in a storage without memory."""

from __future__ import annotations

from bondgraph.elements import C, Element
from bondgraph.graph import BondGraph
from bondgraph.laws import Polynomial
from identification.diagnosis.effects.effect import Effect, Insertion, storages
from identification.diagnosis.scene import Scene


class NonlinearStiffness(Effect):
    """Effort bends away from the straight line with displacement."""

    name = "nonlinear_stiffness"
    family = "restoring"
    law = "polynomial"
    sentence = "its effort bends away from the straight line as it is charged or stretched"
    confused_with = ("sensor_nonlinearity", "saturation")
    source = "Duffing 1918; series of the stored energy"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Storages."""
        return storages(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Quadratic and cubic term about the centre of the record."""
        assert isinstance(element, C)
        past = scene.of(element)
        law = Polynomial(past.centre, past.half, 0.1 * past.swing)
        names = tuple(p.name for p in law.parameters(element.name))
        graph = scene.graph.with_element(element.name, law=law)
        return self.inserted(element, graph, ({},), names)
