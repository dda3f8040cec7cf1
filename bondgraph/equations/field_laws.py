"""The laws of multiport stores and resistors, from an energy, a matrix or expressions."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, Field, RField
from bondgraph.graph.modulation import port_variables
from bondgraph.support.errors import GraphError


def exact(value: float) -> sp.Rational:
    """Return the decimal a user wrote as an exact number.

    Raises
    ------
    GraphError
        It is not finite.
    """
    if not isfinite(value):
        raise GraphError(f"{value} is no finite number; give one")
    return sp.Rational(repr(float(value))) if isinstance(value, float) else sp.Integer(value)


def crossed_ports(
    laws: tuple[sp.Expr, ...],
    local: tuple[sp.Symbol, ...],
    inverted: list[int],
    vanishes: Callable[[sp.Expr], bool],
) -> dict[int, tuple[dict[int, sp.Expr], sp.Expr]]:
    """Invert linear ports together if one of them has no slope of its own (a gyrator as a field).

    Returns, for each inverted port, weights of the outputs and what the other variables take away.
    """
    jacobian = sp.Matrix(laws).jacobian(local)
    block = jacobian.extract(inverted, inverted)
    if jacobian.free_symbols & set(local) or not any(
        vanishes(block[i, i]) for i in range(block.rows)
    ):
        return {}
    if vanishes(block.det()):
        return {}
    inverse = block.inv()
    without = {local[i]: sp.S.Zero for i in inverted}
    found = {}
    for row, i in enumerate(inverted):
        weights = {j: inverse[row, c] for c, j in enumerate(inverted) if inverse[row, c] != 0}
        found[i] = weights, sp.Add(*(w * laws[j].xreplace(without) for j, w in weights.items()))
    return found


def field_laws(graph: BondGraph, e: Field) -> tuple[sp.Expr, ...]:
    """Return the law of every port in port variables and parameters.

    Raises
    ------
    GraphError
        Nothing (or too much) is given, sizes differ, or a symbol is unknown.
    """
    n = e.ports
    local = port_variables(e.letter, n)
    energy = getattr(e, "energy", None)
    for what in ("law", "matrix"):
        if not isinstance(getattr(e, what), tuple | list):
            raise GraphError(
                f"{graph.name}: {what} of {e.name} is a {type(getattr(e, what)).__name__}; give a "
                "tuple of expressions or numbers (of an array: tolist())"
            )
    given = [k for k, v in (("law", e.law), ("matrix", e.matrix), ("energy", energy)) if v]
    if len(given) != 1:
        have = " and ".join(given) or "none"
        wanted = "law or matrix" if isinstance(e, RField) else "energy, law or matrix"
        raise GraphError(f"{graph.name}: {e.name} ({e.kind}) needs one of {wanted}, it has {have}")
    if given == ["energy"]:
        laws = tuple(sp.diff(_known(graph, e, energy, local), v) for v in local)
    elif given == ["matrix"]:
        if len(e.matrix) != n or any(len(row) != n for row in e.matrix):
            raise GraphError(f"{graph.name}: the matrix of {e.name} is not {n} by {n}")
        laws = tuple(
            sum(
                (_known(graph, e, k, ()) * v for k, v in zip(row, local, strict=True)),
                sp.S.Zero,
            )
            for row in e.matrix
        )
    else:
        if len(e.law) != n:
            raise GraphError(f"{graph.name}: {e.name} has {n} ports and {len(e.law)} laws")
        laws = tuple(_known(graph, e, k, local) for k in e.law)
    return laws


def _known(graph: BondGraph, e: Element, value: Any, local: tuple[sp.Symbol, ...]) -> sp.Expr:
    if isinstance(value, str):
        return graph.declared(value, e.name)
    if isinstance(value, int | float):
        return exact(value)
    ports = {str(v) for v in local}
    own = graph.declared_parameters
    for s in sorted(value.free_symbols, key=str):
        name = str(s)
        if s in local:
            if name in own and own[name].symbol == s:
                raise GraphError(
                    f"{graph.name}: {name} in the law of {e.name} is both a port variable and a "
                    "parameter; rename the parameter"
                )
        elif name in ports and name not in own:
            raise GraphError(
                f"{graph.name}: {name} in the law of {e.name} is not the port variable of that "
                "name; take it from bondgraph.graph.modulation.port_variables"
            )
        elif graph.declared(name, e.name) != s:
            raise GraphError(
                f"{graph.name}: {name} in the law of {e.name} is not the symbol of the parameter "
                "of that name (its assumptions differ); use what BondGraph.parameter returned"
            )
    return value
