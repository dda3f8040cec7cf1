"""A linear element that the model lacks beside one that it has: what moves with it, or loses."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

from bondgraph.graph.elements import C, Element, I, R
from bondgraph.graph.parameter import Parameter
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.starts import at_least, rubbing_units
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

TYPICAL = 0.1
"""Part of the effort at the place that the element has at first."""
LEAST = 1e-6
"""Smallest and, its inverse, largest coefficient over the typical one."""


class LackingElement(Effect):
    """An element on the flow of another one, its effort in proportion to one variable."""

    family = "storage"
    plain = True
    word: ClassVar[str]
    """Name of the coefficient, without the element."""

    @abstractmethod
    def variable(self, past: PortHistory, element: Element) -> Array:
        """Return what the effort is in proportion to, shape (N,), SI."""

    @abstractmethod
    def unit(self, element: Element) -> str:
        """Return the unit of the coefficient."""

    @abstractmethod
    def held(self, name: str, coefficient: str, unit: str) -> C | I | R:
        """Return the element beside the one of that name; its coefficient is a parameter."""

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Effort of a unit coefficient."""
        return (Signature.of((self.variable(scene.of(element), element),)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Hang the element at the junction of the one whose flow it has."""
        g, past = scene.graph, scene.of(element)
        way = self.variable(past, element)
        size = float(abs(way).max()) or 1.0
        typical = TYPICAL * past.swing / size
        amount = Parameter(
            f"{self.word}_{element.name}", typical, self.unit(element),
            lower=LEAST * typical, upper=typical / LEAST, scale=typical,
        )  # fmt: skip
        made = self.held(element.name, amount.name, self.unit(element))
        graph = g.with_parameters([amount]).with_branch(g.neighbour(element.name), [made])
        tried = [typical, 10.0 * typical]
        if hint is not None:
            tried = [at_least(hint.weights[0], 0.1 * typical), *tried]
        starts = tuple({amount.name: v} for v in tried)
        return self.inserted(element, graph, starts, (amount.name,))


def per(element: Element, what: int) -> str:
    """Return the unit of an effort over the flow (1), its rate (0) or the displacement (2).

    Examples
    --------
    >>> from bondgraph import I, R
    >>> per(I("m", 1.0, unit="kg"), 1), per(I("J", 1.0, unit="kg*m2"), 2)
    ('N*s/m', 'N*m/rad')
    >>> per(R("d", 1.0, unit="N*s/m"), 0), per(R("R", 1.0, unit="ohm"), 0)
    ('kg', 'H')
    >>> per(I("L", 1.0, unit="H"), 1)
    'ohm'
    """
    units = rubbing_units(element)
    if not what:
        return {"N": "kg", "N*m": "kg*m2", "V": "H"}.get(units[0], f"{units[0]}/({units[1]}/s)")
    effort, over = units[0], units[what].replace("^", "")
    way = over.removesuffix("/s")
    made = f"{effort}*s/{way}" if way != over else f"{effort}/{over}"
    return "ohm" if made == "V/A" else made
