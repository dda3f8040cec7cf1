"""Effects in a mechanical resistor: dry friction, friction that falls with speed, drag."""

from __future__ import annotations

from bondgraph.elements import Element
from bondgraph.graph import BondGraph
from bondgraph.laws import Coulomb, QuadraticDrag, Stribeck
from identification.diagnosis.effects.effect import Effect, Insertion, mechanical_resistors
from identification.diagnosis.scene import Scene


class CoulombFriction(Effect):
    """Dry friction of constant level."""

    name = "coulomb_friction"
    family = "friction"
    law = "coulomb"
    sentence = "a force of constant size opposes every motion and holds at rest"
    confused_with = ("stribeck_friction", "hysteresis")
    source = "Coulomb 1785; Moreau 1988 for the implicit step"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Mechanical resistors."""
        return mechanical_resistors(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Coulomb law beside the viscous one."""
        force = max(scene.of(element).swing, 1e-12)
        law = Coulomb(0.3 * force)
        (p,) = law.parameters(element.name)
        graph = scene.graph.with_element(element.name, law=law)
        return self.inserted(element, graph, ({}, {p.name: 0.05 * force}), (p.name,))


class StribeckFriction(Effect):
    """Dry friction whose level falls with speed."""

    name = "stribeck_friction"
    family = "friction"
    law = "stribeck"
    sentence = "dry friction that is larger near rest than in motion"
    confused_with = ("coulomb_friction",)
    simpler = ("coulomb_friction",)
    source = "Armstrong-Helouvry et al., Automatica 30 (1994) 1083"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Mechanical resistors."""
        return mechanical_resistors(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Stribeck law beside the viscous one."""
        past = scene.of(element)
        force, speed = max(past.swing, 1e-12), past.rms
        law = Stribeck(0.2 * force, 0.1 * force, 0.3 * speed)
        names = tuple(p.name for p in law.parameters(element.name))
        graph = scene.graph.with_element(element.name, law=law)
        starts: tuple[dict[str, float], ...] = (
            {},
            {names[0]: 0.05 * force, names[1]: 0.05 * force, names[2]: 0.1 * speed},
        )
        return self.inserted(element, graph, starts, names[:2])


class Drag(Effect):
    """Force that grows with the square of the speed."""

    name = "quadratic_drag"
    family = "friction"
    law = "quadratic_drag"
    sentence = "a force that grows with the square of the speed opposes the motion"
    confused_with = ("coulomb_friction",)
    source = "Newton's drag law"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Mechanical resistors."""
        return mechanical_resistors(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Quadratic law beside the viscous one."""
        past = scene.of(element)
        law = QuadraticDrag(0.2 * past.swing / past.half**2)
        (p,) = law.parameters(element.name)
        graph = scene.graph.with_element(element.name, law=law)
        return self.inserted(element, graph, ({},), (p.name,))
