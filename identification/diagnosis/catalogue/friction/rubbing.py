"""Friction at a damper of the model, or on a motion that meets none in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, I, R
from bondgraph.laws import Law
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.lacking_element import per
from identification.diagnosis.catalogue.places import masses, mechanical_resistors, undamped
from identification.diagnosis.screening.port_history import FittedModel

VISCOUS = 0.05
"""Part of the effort at a mass that a damper has there at first, beside the friction."""


class Rubbing(Effect):
    """A law of friction; where a mass has no damper it brings one along; abstract."""

    family = "friction"
    simpler: ClassVar[tuple[str, ...]] = ("linear_loss",)
    meanings: ClassVar[Mapping[str, str]] = {"d": "damper beside it, where the model has none"}

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return mechanical resistors, and masses without one."""
        heavy = {e.name for e in masses(graph)}
        return (
            *mechanical_resistors(graph),
            *(e for e in undamped(graph) if isinstance(e, I) and e.name in heavy),
        )

    def home(self, element: Element) -> bool:
        """Whether the model knows that something is lost there."""
        return isinstance(element, R)

    def with_law(
        self, scene: FittedModel, element: Element, law: Law
    ) -> tuple[BondGraph, tuple[str, ...]]:
        """Return the graph with the law at the resistor, or at a new one beside a mass."""
        if isinstance(element, R):
            return super().with_law(scene, element, law)
        past, name = scene.of(element), f"d_{element.name}"
        while name in scene.graph.elements or name in scene.graph.parameters:
            name += "_"
        damper = R(name, VISCOUS * past.swing / past.largest, unit=per(element, 1), law=law)
        graph = scene.graph.with_branch(scene.graph.neighbour(element.name), [damper])
        return graph, tuple(p.name for p in law.parameters(name) if not p.fixed)
