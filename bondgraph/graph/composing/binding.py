"""Parameters of a sub-graph bound to numbers, or to parameters and signals of the graph outside."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.renaming import declared_parameters, mentioned_names
from bondgraph.graph.elements import C, TwoPort
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import GraphError, UnusableInput, require_known, unknown_name

Binding: TypeAlias = float | str | Any
"""A number, the name of a parameter outside, or a SymPy expression of parameters outside."""


def bound(
    outer: BondGraph, sub: BondGraph, name: str, bindings: Mapping[str, Binding]
) -> tuple[BondGraph, dict[str, str | sp.Expr]]:
    """Put the bindings in: new numbers go into the sub-graph, the rest replaces parameters."""
    known = sub.parameters
    external = external_signals(sub)
    settable = {*sub.elements, *(p.name for p in declared_parameters(sub))}
    values: dict[str, str | sp.Expr] = {}
    for key, binding in bindings.items():
        if key not in known and key not in external:
            raise unknown_name("parameter", key, sub.name, [*known, *external])
        if key in known and key not in settable:
            raise GraphError(
                f"{sub.name}: {key} belongs to a law, which holds its value; change the law"
            )
        if isinstance(binding, int | float) and not isinstance(binding, bool):
            if key in external:
                values[key] = sp.Float(binding)
            else:
                sub = sub.with_values({key: float(binding)})
            continue
        value = _outside(outer, f"{name}.{key}", binding)
        if key in known:
            _same_dimension(outer, sub.name, known[key], value)
        values[key] = value
    return _without_values(sub, values), values


def _outside(outer: BondGraph, where: str, binding: Binding) -> sp.Expr:
    """Return the expression a binding stands for."""
    if isinstance(binding, str):
        require_known("parameter", f"{outer.name}, for {where}", outer.parameters, binding)
        return outer.parameters[binding].symbol
    if not isinstance(binding, sp.Expr):
        raise GraphError(
            f"{where} is bound to {binding!r}: give a number, the name of a parameter of "
            f"{outer.name} or a SymPy expression"
        )
    return binding


def _same_dimension(outer: BondGraph, where: str, p: Parameter, value: sp.Expr) -> None:
    other = outer.parameters.get(str(value)) if isinstance(value, sp.Symbol) else None
    if other is None or "1" in (p.unit, other.unit) or not (p.unit and other.unit):
        return
    try:
        same = parse_unit(p.unit).same_dimension(parse_unit(other.unit))
    except UnusableInput:
        return
    if not same:
        raise GraphError(
            f"{where}.{p.name} is in {p.unit}, but {outer.name}.{other.name} is in {other.unit}: "
            "bind a parameter of the same dimension"
        )


def _without_values(sub: BondGraph, values: Mapping[str, str | sp.Expr]) -> BondGraph:
    """Let elements whose own number is bound take the binding as their value."""
    for n, value in values.items():
        if n in sub.elements and not isinstance(value, str):
            e = sub[n]
            label = "ratio" if isinstance(e, TwoPort) else "value"
            if isinstance(e, C) and e.stiffness is not None:
                label = "stiffness"
            sub = sub.with_element(n, **{label: n})  # the renaming puts the expression in
    return sub


def external_signals(sub: BondGraph) -> tuple[str, ...]:
    """Signals from outside that the expressions of a graph mention."""
    found = {n for e in sub.elements.values() for n in mentioned_names(e)}
    return tuple(sorted(n for n in found if n.startswith("in_") and n not in sub.parameters))
