"""Friction at a damper of the model, or on a motion that meets none in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, I, R
from bondgraph.laws import Law
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.lacking_element import free_name, per
from identification.diagnosis.catalogue.places import mechanical_resistors, moves, undamped
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
        bare = (e for e in undamped(graph) if isinstance(e, I) and moves(graph, e))
        return (*mechanical_resistors(graph), *bare)

    def home(self, element: Element) -> bool:
        """Whether the model knows that something is lost there."""
        return isinstance(element, R)

    def with_law(
        self, scene: FittedModel, element: Element, law: Law
    ) -> tuple[BondGraph, tuple[str, ...]]:
        """Return the graph with the law at the resistor, or at a new one beside a mass."""
        if isinstance(element, R):
            return super().with_law(scene, element, law)
        past, name = scene.of(element), free_name(scene.graph, f"d_{element.name}")
        unit = per(scene.graph, element, 1)
        damper = R(name, VISCOUS * past.swing / past.largest, unit=unit, law=law)
        graph = scene.graph.with_branch(scene.graph.neighbour(element.name), [damper])
        return graph, tuple(p.name for p in law.parameters(name) if not p.fixed)
