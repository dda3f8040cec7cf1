"""A linear element that the model lacks beside one that it has: what moves with it, or loses."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import ClassVar

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I, R
from bondgraph.graph.parameter import Parameter
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import sense
from identification.diagnosis.catalogue.starts import at_least, rubbing_units
from identification.diagnosis.localisation.recording.variables import (
    GENERIC,
    Variables,
    variables_beside,
    variables_of,
)
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

TYPICAL = 0.1
"""Part of the effort at the place that the element has at first."""
SIZES = (1.0, 10.0, 0.1, 1e2, 1e3, 1e4)
"""Times that coefficient that are tried as starts."""
LEAST = 1e-6
"""Smallest and, its inverse, largest coefficient over the typical one."""


class LackingElement(Effect):
    """An element on the flow of another one, its effort in proportion to one variable."""

    family = "storage"
    plain = True
    word: ClassVar[str]
    """Name of the coefficient, without the element."""
    over: ClassVar[int]
    """What the effort is in proportion to: the rate of the flow (0), it (1), its integral (2)."""

    things: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """What the element is called, by the unit of the effort there; else by its name."""
    whichever: ClassVar[str] = ""
    """What its sentence and the meaning of its coefficient call it where that is not known."""
    does: ClassVar[str] = ""
    """What it does, with ``{flow}`` and ``{displacement}`` for the words of its domain."""

    def thing(self, graph: BondGraph, element: Element) -> str:
        """Return what the element is called in the domain of its place; empty if unknown."""
        return self.things.get(domain_at(graph, element).effort_unit, "")

    def said(self, graph: BondGraph, element: Element) -> str:
        """Return the sentence of the effect in words of its place."""
        v, thing = domain_at(graph, element), self.thing(graph, element)
        if not thing or not self.does:
            return self.sentence
        does = self.does.format(flow=v.flow, displacement=v.displacement)
        return f"{'an' if thing[0] in 'aeiou' else 'a'} {thing} that the model lacks {does}"

    @abstractmethod
    def variable(self, past: PortHistory, element: Element) -> Array:
        """Return what the effort is in proportion to, shape (N,), SI."""

    @abstractmethod
    def held(self, name: str, coefficient: str, unit: str) -> C | I | R:
        """Return the element, its coefficient a parameter."""

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Effort of a unit coefficient."""
        added = sense(scene.graph, element) * self.variable(scene.of(element), element)
        return (Signature.of((added,)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Hang the element at the junction of the one whose flow it has."""
        g, past = scene.graph, scene.of(element)
        way = self.variable(past, element)
        size = float(abs(way).max()) or 1.0
        typical = TYPICAL * past.swing / size
        unit = per(g, element, self.over)
        amount = Parameter(
            free_name(g, f"{self.word}_{element.name}"), typical, unit,
            lower=LEAST * typical, upper=typical / LEAST, scale=typical,
        )  # fmt: skip
        made = self.held(free_name(g, f"lacking_{element.name}"), amount.name, unit)
        graph = g.with_parameters([amount]).with_branch(g.neighbour(element.name), [made])
        # of a model without it the course may be off by decades: ways that drift, flows that ring
        tried = [typical * times for times in SIZES]
        if hint is not None:
            tried = [at_least(hint.weights[0], 0.1 * typical), *tried]
        starts = tuple({amount.name: v} for v in tried)
        inserted = self.inserted(element, graph, starts, (amount.name,))
        return replace(inserted, sentence=self.said(g, element))


def free_name(graph: BondGraph, name: str) -> str:
    """Return a name that neither an element nor a parameter has: this one, or with ``_`` behind."""
    while name in graph.elements or name in graph.parameters:
        name += "_"
    return name


def domain_at(graph: BondGraph, element: Element) -> Variables:
    """Return the variables of an element, of one without a unit those of what hangs beside it."""
    v = variables_of(element)
    if v is GENERIC and not getattr(element, "unit", "") and element.name in graph.elements:
        v = variables_beside(graph, graph.neighbour(element.name))
    return v


def per(graph: BondGraph, element: Element, what: int) -> str:
    """Return the unit of an effort over the flow (1), its rate (0) or the displacement (2).

    Of an element without a unit by what hangs beside it.

    Examples
    --------
    >>> from bondgraph import BondGraph, I, One, R
    >>> with BondGraph("plane") as g:
    ...     mass = One("body") >> I("m", 1.0, unit="kg")
    ...     wire = One("loop") >> R("R", 1.0, unit="ohm")
    >>> [per(g, g["m"], k) for k in (0, 1, 2)], [per(g, g["R"], k) for k in (0, 1)]
    (['kg', 'N*s/m', 'N/m'], ['H', 'ohm'])
    """
    v = domain_at(graph, element)
    units = rubbing_units(element)
    if v is not GENERIC:
        units = (v.effort_unit, v.flow_unit, v.displacement_unit)
    if not what:
        known = {"N": "kg", "N*m": "kg*m2", "V": "H"}
        return known.get(units[0], f"{units[0]}/({units[1]}/s)")
    effort, over = units[0], units[what].replace("^", "")
    way = over.removesuffix("/s")
    made = f"{effort}*s/{way}" if way != over else f"{effort}/{over}"
    return {"V/A": "ohm", "m*s/m3": "s/m2", "m/m3": "1/m2"}.get(made, made)
