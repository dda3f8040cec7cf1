"""What an element says of named signals: a relation, a use of a law, what is stored.

A relation is ``target = sum(coefficient * signal) + expression + deviation of a law``; an implicit
one is ``0 = residual(target, ..)``. Coefficients and expressions are SymPy, signals are names, so a
graph of 10^5 bonds costs no symbolic work before someone asks for a closed form.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from bondgraph.causality.assignment import Causality
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Dq
from bondgraph.laws.law import Law

FINE = "fine_"
"""Begins the name of what a reading is before it is rounded; that of the sensor follows."""


@dataclass(frozen=True, slots=True)
class Relation:
    """``target = sum(c * s for c, s in terms) + expression + deviation``, or an implicit one.

    Attributes
    ----------
    target : str
    terms : tuple of (coefficient, str)
        Coefficients are ints or SymPy expressions of parameters and signals.
    reason : str
    expression : sympy.Expr or None
        Nonlinear rest, in signals and parameters.
    law : int or None
        Position of the law whose deviation is added.
    implicit : bool
        ``terms + expression + deviation`` is a residual that vanishes instead.
    reads : tuple of str
        Signals in coefficients, in the expression and in the argument of the law.
    """

    target: str
    terms: tuple[tuple[Any, str], ...]
    reason: str
    expression: sp.Expr | None = None
    law: int | None = None
    implicit: bool = False
    reads: tuple[str, ...] = ()

    @property
    def sources(self) -> Iterable[str]:
        """All signals on the right-hand side."""
        return [s for _, s in self.terms] + list(self.reads)


def readers_in(found: Iterable[Relation]) -> Callable[[str], Iterable[str]]:
    """Return what gives the targets of the relations that read a signal."""
    readers: dict[str, list[str]] = {}
    for r in found:
        for s in r.sources:
            readers.setdefault(s, []).append(r.target)
    return lambda name: readers.get(name, ())


@dataclass(frozen=True, slots=True)
class LawUse:
    """A law with the signal it acts on; `slope` times it is in the relation's terms."""

    element: str
    role: str
    law: Law
    argument: str
    slope: Any
    parameters: tuple[str, ...]

    @property
    def ports(self) -> tuple[str, ...]:
        """Names of the ports it takes: its own, and that of the gauge of what the law watches."""
        return (self.element, *((f"beside_{self.element}",) if self.law.watched else ()))


@dataclass(frozen=True, slots=True)
class StoredState:
    """A state and the signal that is its rate."""

    name: str
    rate: str
    element: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Dependent:
    """A storage in derivative causality: `stored` follows from others, `rate` is its derivative."""

    stored: str
    rate: str
    element: str


@dataclass
class Relations:
    """What `collect` finds; filled element by element."""

    graph: BondGraph
    causality: Causality
    found: dict[str, Relation] = field(default_factory=dict)
    states: list[StoredState] = field(default_factory=list)
    dependents: list[Dependent] = field(default_factory=list)
    inputs: list[str] = field(default_factory=list)
    outputs: list[tuple[str, str, str]] = field(default_factory=list)
    laws: list[LawUse] = field(default_factory=list)
    displacements: list[Dq] = field(default_factory=list)
    rates: list[Dependent] = field(default_factory=list)
    recorded: list[str] = field(default_factory=list)  # rates of inputs known by their integral
    aliases: dict[str, str] = field(default_factory=dict)
