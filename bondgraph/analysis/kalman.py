"""Exact controllability and observability matrices for almost all parameters.

Everything is computed at random parameter values in a prime field: no rounding, no growth, and a
rank that is the rank for all parameters but those on a set of measure zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TypeAlias

import sympy as sp

from bondgraph.analysis.exact_algebra import generic_values, modular, rank
from bondgraph.analysis.linear import linear_rates
from bondgraph.equations.derivation import equations
from bondgraph.equations.elimination import PRIME
from bondgraph.equations.system import System
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import MGY, MTF, Source, Valued
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.simulation.start import own_input

Matrix: TypeAlias = list[list[int]]
RATES = ("", "d_", "d2_", "d3_")
"""What an input and its rates are called before its name."""
_TURNS: tuple[Callable[[sp.Expr], sp.Expr], ...] = (
    lambda n: n, lambda n: -n, lambda n: 1 / n, lambda n: -1 / n,
)  # fmt: skip


def kalman_ranks(graph: BondGraph, seed: int = 1) -> tuple[int, int, int]:
    """Return the ranks of the controllability and observability matrices, and the order.

    Exact at random parameter values in a prime field, so the rank for almost all parameters.
    """
    model = equations(linear_skeleton(graph))
    a, b, c = generic_matrices(model, seed)
    n = model.order
    inputs = [list(column) for column in zip(*b, strict=True)]
    moved = rank(_krylov(a, inputs))
    return moved, rank(_krylov(transposed(a, n), c)), n


def linear_skeleton(graph: BondGraph) -> BondGraph:
    """Return the graph with the linear part of every law and constant ratios.

    A resistor whose law has no linear part becomes a linear one: it has a slope somewhere. A ratio
    that follows signals, or is a number, becomes a parameter: nothing says that it is 1. Ratios
    of one expression, turned round or not, share theirs.
    """
    graph = in_mode(graph)
    for e in graph.of_type(Valued):
        if e.law is not None:
            empty = e.value in (None, 0) and getattr(e, "stiffness", None) is None
            graph = graph.with_element(e.name, law=None, **({"value": 1.0} if empty else {}))
    for e in graph.of_type(Sensor):
        if e.law is not None or e.resolution is not None:
            graph = graph.with_element(e.name, law=None, resolution=None)
    for e in graph.of_type(Source):
        if e.drive is not None and e.drive.law is not None:
            # the law may be what changes volts into newtons: the unit goes with it
            graph = graph.with_element(e.name, drive=replace(e.drive, law=None), unit="")
    return _with_constant_ratios(graph)


def _with_constant_ratios(graph: BondGraph) -> BondGraph:
    own = {p.symbol for p in graph.parameters.values()}
    made: dict[sp.Expr, sp.Expr] = {}
    for e in graph.of_type(MTF, MGY):
        if isinstance(e.ratio, str):
            continue  # a declared parameter already
        ratio = sp.sympify(e.ratio)
        if ratio.free_symbols and ratio.free_symbols <= own:
            continue
        # two numbers are two ratios, one expression of signals is one
        turns = _TURNS if ratio.free_symbols else ()
        shared = next((turn(made[turn(ratio)]) for turn in turns if turn(ratio) in made), None)
        if shared is None:
            name = f"ratio_{e.name}"
            while name in graph.parameters or name in graph.elements:
                name += "_"
            parameter = Parameter(name, 1.0, positive=False)
            graph = graph.with_parameters([parameter])
            shared = made[ratio] = parameter.symbol
        graph = graph.with_element(e.name, ratio=shared)
    return graph


def generic_matrices(model: System, seed: int) -> tuple[Matrix, Matrix, Matrix]:
    """Return A, B, C in the prime field at random parameters; B without derivatives of inputs.

    ``x' = A x + B0 u + B1 u' + ..`` becomes ``z' = A z + (B0 + A B1 + ..) u`` for
    ``z = x - B1 u - ..``.
    """
    names = [u for u in model.inputs if own_input(u, 1) is None]
    values = generic_values(model.parameters, seed)
    a, by_rate, c, _ = modular_matrices(model, values, names)
    n = model.order
    b: Matrix = [[] for _ in range(n)]
    for u in range(len(names)):
        column = [0] * n
        for rates in reversed(by_rate):
            moved = product(a, column)
            column = [(p + row[u]) % PRIME for p, row in zip(moved, rates, strict=True)]
        for i in range(n):
            b[i].append(column[i])
    return a, b, c


def modular_matrices(
    model: System, values: Mapping[str, Fraction], inputs: Sequence[str], modulus: int = PRIME
) -> tuple[Matrix, list[Matrix], Matrix, list[Matrix]]:
    """Return A, B, C, D at exact parameter values; B and D by the inputs and each of their rates.

    Raises
    ------
    UnusableInput
        The model is not linear.
    """
    outputs = tuple(
        replace(model.stored[0], name=f"reading_{n}", rate=signal)
        for n, signal, _ in (model.readings if model.stored else ())
    )
    wide = replace(model, stored=(*model.stored, *outputs))
    forms = linear_rates(wide, values)  # type: ignore[arg-type]

    def table(part: slice, prefix: str, names: Sequence[str]) -> Matrix:
        return [[modular(f.get(prefix + x, 0), modulus) for x in names] for f in forms[part]]

    states, readings = slice(0, model.order), slice(model.order, None)
    b, d = ([table(part, r, inputs) for r in RATES] for part in (states, readings))
    return table(states, "", model.states), b, table(readings, "", model.states), d


def product(a: Matrix, v: Sequence[int], modulus: int = PRIME) -> list[int]:
    """Return a matrix times a vector in the prime field, or modulo a power of the prime."""
    return [sum(x * y for x, y in zip(row, v, strict=True)) % modulus for row in a]


def transposed(a: Matrix, n: int) -> Matrix:
    """Return the columns of a matrix; `n` empty ones if it has no row."""
    width = len(a[0]) if a else n
    return [[row[j] for row in a] for j in range(width)]


def _krylov(a: Matrix, starts: Matrix) -> Matrix:
    """Return ``v, A v, A^2 v, ..`` for every vector of `starts`."""
    found = []
    for v in starts:
        for _ in a:
            found.append(list(v))
            v = product(a, v)
    return found


def null_vectors(form: Sequence[tuple[int, list[int]]], n: int) -> list[list[int]]:
    """Return a basis of the null space of a reduced echelon form with `n` columns."""
    pivots = {c for c, _ in form}
    basis = []
    for free in range(n):
        if free in pivots:
            continue
        v = [0] * n
        v[free] = 1
        for c, row in form:
            v[c] = -row[free] % PRIME
        basis.append(v)
    return basis
