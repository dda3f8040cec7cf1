"""All relations between inputs and readings alone: which equations combine to them.

With n unknowns and n + n_y equations there are n_y independent combinations without unknowns. One
equation a sensor is set aside as the residual, the others give every unknown. Which ones follows
from diagnostic causality: a sensor that can impose what it reads frees the balance of its junction
(Samantaray and Ould Bouamama, Model-based Process Supervision, 2008, ch. 4); where it cannot, its
own reading is compared with what the other equations give.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import sympy as sp

from bondgraph.analysis.exact_algebra import Row, generic_values, solve
from bondgraph.analysis.linear import LAPLACE
from bondgraph.analysis.operator_equations import (
    OperatorEquation,
    OperatorEquations,
    Positions,
    operator_equations,
)
from bondgraph.causality.assignment import (
    CausalConflict,
    Causality,
    assign_causality,
    storage_ports,
)
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Reading, Sensor
from bondgraph.support.errors import GraphError, UnusableInput

MOST_TRIED = 6


@dataclass(frozen=True)
class Diagnostic:
    """A graph with its sensors inverted as far as causality allows.

    Attributes
    ----------
    equations : OperatorEquations
    inverted : tuple of str
        Sensors that impose what they read.
    integrated : tuple of str
        Storages that keep integral causality; their relations are differentiated further instead.
    residuals : dict of str to int
        The equation that is the residual of every sensor.
    """

    equations: OperatorEquations
    inverted: tuple[str, ...]
    integrated: tuple[str, ...]
    residuals: Mapping[str, int]


@dataclass(frozen=True)
class ResidualSpace:
    """Multipliers of the equations, one row a relation, over an exact field.

    Attributes
    ----------
    diagnostic : Diagnostic
    multipliers : tuple of dict of int to field element
        Zero entries are left out; relation i is ``sum(m * equation)``.
    coefficient : callable
        From SymPy to the field.
    """

    diagnostic: Diagnostic
    multipliers: tuple[Row, ...]
    coefficient: Any

    def known(self, multiplier: Row) -> dict[str, Any]:
        """Return the coefficients of inputs and readings in a combination of equations."""
        total: dict[str, Any] = {}
        for i, m in multiplier.items():
            for c, n in self.diagnostic.equations.equations[i].known:
                value = m * self.coefficient(c)
                total[n] = total[n] + value if n in total else value
        return {n: v for n, v in total.items() if v}

    @cached_property
    def touched(self) -> tuple[frozenset[str], ...]:
        """Elements (sources and sensors too) whose faults enter each relation."""
        q = self.diagnostic.equations
        return tuple(
            frozenset(e for e in q.owners if any(i in m for i in q.rows_of(e)))
            for m in self.multipliers
        )


def diagnostic(graph: BondGraph, places: Positions | None = None) -> Diagnostic:
    """Invert as many sensors as can be, and choose the residual equations.

    Raises
    ------
    GraphError
        There is no sensor, an element is not linear, or the equations determine nothing.
    """
    sensors = tuple(s.name for s in graph.of_type(Sensor))
    if not sensors:
        raise GraphError(
            f"{graph.name}: without a sensor there is no redundancy; add a De, Df or Dq"
        )
    equations = _without_integrals(operator_equations(graph, places))
    # what has no bond cannot be imposed: a reading is compared
    bonded = tuple(s for s in sensors if not isinstance(graph[s], Reading))
    for chosen in _subsets(bonded):
        causality = _causal(graph, chosen)
        if causality is None:
            continue
        residuals = _residuals(graph, equations, chosen)
        made = Diagnostic(equations, chosen, _integrated(graph, causality), residuals)
        if generic_space(made) is not None:
            return made
    raise GraphError(
        f"{graph.name}: its equations do not determine its signals even with all sensors read; "
        "remove a redundant bond, or put a resistance or a storage into the loop"
    )


def _without_integrals(made: OperatorEquations) -> OperatorEquations:
    """Multiply equations of what is recorded by its rate by ``s``."""

    def cleared(q: OperatorEquation) -> OperatorEquation:
        if not any(sp.sympify(c).has(1 / LAPLACE) for c, _ in q.known):
            return q
        unknown, known = (
            tuple((sp.expand(LAPLACE * c), n) for c, n in side) for side in (q.unknown, q.known)
        )
        return replace(q, unknown=unknown, known=known, lag=sp.expand(LAPLACE * q.lag))

    return replace(made, equations=tuple(map(cleared, made.equations)))


def _subsets(sensors: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Yield what to invert, the most sensors first; many sensors only prefix by prefix."""
    if len(sensors) <= MOST_TRIED:
        for size in range(len(sensors), -1, -1):
            yield from combinations(sensors, size)
        return
    for size in range(len(sensors), -1, -1):
        yield sensors[:size]


def _causal(graph: BondGraph, chosen: tuple[str, ...]) -> Causality | None:
    try:
        return assign_causality(graph, prefer="derivative", inverted=chosen)
    except CausalConflict:
        return None


def _integrated(graph: BondGraph, causality: Causality) -> tuple[str, ...]:
    return tuple(n for n, _, _ in storage_ports(graph) if n not in causality.derivative)


def _residuals(
    graph: BondGraph, equations: OperatorEquations, chosen: tuple[str, ...]
) -> dict[str, int]:
    found: dict[str, int] = {}
    for s in equations.sensors:
        owner, role = (graph.neighbour(s), "balance") if s in chosen else (s, "reading")
        (found[s],) = equations.rows_of(owner, (role,))
    return found


def symbolic_space(made: Diagnostic) -> ResidualSpace:
    """Return the multipliers as rational functions of the parameters and ``s``."""
    from sympy.polys.constructor import construct_domain

    coefficients = {LAPLACE, sp.S.One}
    for q in made.equations.equations:
        coefficients |= {sp.sympify(c) for c, _ in (*q.unknown, *q.known)} | {sp.sympify(q.lag)}
    order = sorted(coefficients, key=sp.default_sort_key)
    domain, values = construct_domain(order, field=True)
    table = dict(zip(order, values, strict=True))

    def coefficient(c: Any) -> Any:
        c = sp.sympify(c)
        if c not in table:
            table[c] = domain.from_sympy(c)
        return table[c]

    space = _space(made, coefficient)
    assert space is not None  # the generic solution exists
    return space


def generic_space(made: Diagnostic, seed: int = 20240607) -> ResidualSpace | None:
    """Return the multipliers at random rational parameters and ``s``; None if undetermined.

    What vanishes there vanishes identically, except with negligible probability.
    """
    symbols = set()
    for q in made.equations.equations:
        for c, _ in (*q.unknown, *q.known):
            symbols |= sp.sympify(c).free_symbols
    ordered = sorted(symbols, key=sp.default_sort_key)
    drawn = generic_values([f"{i}" for i in range(len(ordered))], seed)
    put = {v: sp.Rational(*drawn[f"{i}"].as_integer_ratio()) for i, v in enumerate(ordered)}

    def coefficient(c: Any) -> Any:
        value = sp.sympify(c).xreplace(put)
        if not value.is_Rational:
            value = sp.Rational(str(value.evalf(30)))
        from fractions import Fraction

        return Fraction(int(value.p), int(value.q))

    return _space(made, coefficient)


def _space(made: Diagnostic, coefficient: Any) -> ResidualSpace | None:
    q = made.equations
    column = {n: i for i, n in enumerate(q.unknowns)}
    aside = set(made.residuals.values())
    kept = [i for i in range(len(q.equations)) if i not in aside]
    if len(kept) != len(column):
        return None
    # transposed: one row an unknown, one column a kept equation
    rows: list[Row] = [{} for _ in column]
    for position, i in enumerate(kept):
        for c, n in q.equations[i].unknown:
            rows[column[n]][position] = coefficient(c)
    right: list[Row] = [{} for _ in column]
    for k, i in enumerate(made.residuals.values()):
        for c, n in q.equations[i].unknown:
            right[column[n]][k] = -coefficient(c)
    solution = solve(rows, right)
    if solution is None:
        return None
    one = coefficient(sp.S.One)
    multipliers: list[Row] = [{i: one} for i in made.residuals.values()]
    for position, i in enumerate(kept):
        for k, v in solution[position].items():
            multipliers[k][i] = v
    return ResidualSpace(made, tuple(multipliers), coefficient)


def blind(space: ResidualSpace, elements: Sequence[str]) -> tuple[Row, ...]:
    """Return combinations of the relations that faults of `elements` never enter.

    Raises
    ------
    UnusableInput
        Every relation contains one of them: there are too few sensors.
    """
    q = space.diagnostic.equations
    columns = [i for e in elements for i in q.rows_of(e)]
    rows = [{k: m[i] for k, m in enumerate(space.multipliers) if i in m} for i in columns]
    free = _null(rows, len(space.multipliers), space.coefficient(sp.S.One))
    if not free:
        raise UnusableInput(
            f"{q.name}: no relation is blind to {', '.join(elements)} with the sensors "
            f"{', '.join(q.sensors)}; add a sensor"
        )
    found = []
    for weights in free:
        total: Row = {}
        for k, w in weights.items():
            for i, m in space.multipliers[k].items():
                total[i] = total[i] + w * m if i in total else w * m
        found.append({i: m for i, m in total.items() if m})
    return tuple(found)


def _null(rows: Sequence[Row], width: int, one: Any) -> list[Row]:
    """Return a basis of the null space of sparse rows over a field."""
    from sympy.polys.matrices.sdm import sdm_irref, sdm_nullspace_from_rref

    held, pivots, columns = sdm_irref({i: row for i, row in enumerate(rows) if row})
    basis: list[Row] = sdm_nullspace_from_rref(held, one, width, pivots, columns)[0]
    return [dict(sorted(v.items())) for v in basis]
