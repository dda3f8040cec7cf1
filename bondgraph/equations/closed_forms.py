"""Closed SymPy forms of ordered relations, made when they are asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from bondgraph.equations.relation import LawUse, Relation
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.support.errors import BondsightError
from bondgraph.support.ops import SYMPY

_ENDINGS = {"drive": "_drive", "sensor": "_reading"}


@dataclass
class Closing:
    """Closed forms of relations on demand, each made once; more relations may come later.

    Iterative, so that chains of any length do not meet the limit of recursion.

    Parameters
    ----------
    relations : mapping of str to Relation
        By target; what is no target is a leaf.
    laws : sequence of LawUse
    parameters : mapping of str to Parameter
    whole : bool
        Laws stand as functions named after their element, not as their deviations.
    beside : bool
        Laws that stand as functions have the signal that they watch as a second argument.
    """

    relations: Mapping[str, Relation]
    laws: Sequence[LawUse]
    parameters: Mapping[str, Parameter]
    whole: bool = False
    beside: bool = False

    def __post_init__(self) -> None:
        """Start with nothing closed."""
        self.done: dict[str, sp.Expr] = {}
        self._watched: set[str] = set()

    def __call__(self, name: str) -> sp.Expr:
        """Return the closed form of a signal; of a leaf its symbol."""
        todo = [name]
        while todo:
            top = todo[-1]
            if top in self.done or top not in self.relations:
                todo.pop()
                continue
            r = self.relations[top]
            missing = [s for s in r.sources if s in self.relations and s not in self.done]
            if missing:
                todo.extend(missing)
                continue
            self.done[top] = self._put_in(r)
            todo.pop()
        return self.done.get(name, symbol(name))

    def value(self, r: Relation) -> sp.Expr:
        """Return the right-hand side (or the residual) of a relation in closed form."""
        for s in r.sources:
            self(s)
        return self._put_in(r)

    def _put_in(self, r: Relation) -> sp.Expr:
        reads = {symbol(s): self.done[s] for s in r.reads if s in self.done}
        use = None if r.law is None else self.laws[r.law]
        parts = [
            (c.xreplace(reads) if isinstance(c, sp.Expr) else c) * self.done.get(s, symbol(s))
            for c, s in (rest_terms(r, use) if self.whole else r.terms)
        ]
        if r.expression is not None:
            parts.append(r.expression.xreplace(reads))
        if use is not None:
            argument = self.done.get(use.argument, symbol(use.argument))
            seen = self._seen(use)
            parts.append(
                law_function(r, use)(argument, *seen)
                if self.whole
                else law_expression(use, self.parameters, argument, seen)
            )
        return sp.Add(*parts)

    def _seen(self, use: LawUse) -> tuple[sp.Expr, ...]:
        """Return the signal that a law watches in closed form; none where it watches none."""
        name = use.law.watched
        if not (self.beside and name):
            return ()
        if name in self._watched:
            return (symbol(name),)  # what is watched follows from the law in turn
        self._watched.add(name)
        seen = self(name)
        self._watched.discard(name)
        return (seen,)


def rest_terms(r: Relation, use: LawUse | None) -> tuple[tuple[Any, str], ...]:
    """Return the terms of a relation without the linear part of its law, if that is whole here."""
    if use is None or r.target == f"w_{use.element}":
        return r.terms
    kept = ((c - use.slope if s == use.argument else c, s) for c, s in r.terms)
    return tuple((c, s) for c, s in kept if c != 0)


def law_function(r: Relation, use: LawUse) -> Any:
    """Return the function that a law is named by; by its deviation where that is a signal."""
    deviation = r.target == f"w_{use.element}"
    ending = "_deviation" if deviation else _ENDINGS.get(use.role, "")
    return sp.Function(f"{use.element}{ending}")


def law_expression(
    use: LawUse,
    parameters: Mapping[str, Parameter],
    argument: sp.Expr,
    seen: tuple[sp.Expr, ...] = (),
) -> sp.Expr:
    """Return the deviation of a law as SymPy; one with memory or a jump as a named function."""
    law = use.law
    if not law.n_memory and not law.set_valued:
        found = deviation_formula(use, parameters, argument)
        if found is not None:
            return found
    return sp.Function(f"{use.element}_deviation")(argument, *seen)


def deviation_formula(
    use: LawUse, parameters: Mapping[str, Parameter], argument: sp.Expr
) -> sp.Expr | None:
    """Return the deviation of a law as SymPy, a watched signal by its name.

    None for a law with memory of its own or of time, or in numbers only.
    """
    law = use.law
    watched = (symbol(law.watched),) * 2 if law.watched else ()  # as it was and as it is: at rest
    if law.timed or law.n_memory != len(watched):
        return None
    try:
        p = tuple(parameters[n].symbol for n in use.parameters)
        return sp.sympify(law.deviation(SYMPY, argument, watched, p))
    except (TypeError, AttributeError, BondsightError):
        return None  # a law in numbers only (a table)
