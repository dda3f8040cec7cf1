"""A list of relations in states, their rates and inputs -> an `Answer` that can be judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.linalg as sla
import sympy as sp
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from tests.proof.conformance.answer import Answer
from tests.proof.conformance.case import Case
from tests.proof.conformance.numbers import evaluate, random_values

_RANK = 1e-9
_SEED = 5


def from_relations(case: Case, relations: Sequence[sp.Expr], fixed: Mapping[str, float]) -> Answer:
    """Sort relations (each zero) into rates, constraints and what must hold besides.

    Relations without rates are constraints; the states they determine become implicit unknowns. The
    rates follow from the others and from the constraints differentiated.

    Parameters
    ----------
    case : Case
    relations : sequence of sympy.Expr
        In ``q_x, dq_x, u_x, du_x`` and parameters; other names stay and are undefined.
    fixed : dict of str to float
        Numbers the tool was given for parameters.

    Raises
    ------
    UnusableInput
        A relation is not linear in the rates.
    """
    states = list(case.stores)
    rates = [sp.Symbol(f"d{s}") for s in states]
    dynamic = [r for r in relations if r.free_symbols & set(rates)]
    constraints = [r for r in relations if not r.free_symbols & set(rates)]
    point = _anywhere([*relations], fixed)
    held = _determined(constraints, states, point)
    kept = [c for c, _ in held]
    rows = [*dynamic, *(_differentiated(c, case) for c in kept)]
    matrix = [[r.diff(d) for d in rates] for r in rows]
    if any(m.free_symbols & set(rates) for row in matrix for m in row):
        raise UnusableInput(f"{case.identity}: the relations are not linear in the rates")
    chosen = _independent_rows(matrix, point)
    solved = _solve([rows[i] for i in chosen], [matrix[i] for i in chosen], rates)
    implicit = {s: c for c, s in held}
    return Answer(
        rates={s: e for s, e in solved.items() if s not in implicit},
        dependent={s: sp.Symbol(s) for s in implicit},
        implicit=implicit,
        order=len(states) - len(held),
        fixed=fixed,
        besides=(*dynamic, *(c for c in constraints if c not in kept)),
    )


def _anywhere(relations: Sequence[sp.Expr], fixed: Mapping[str, float]) -> dict[str, float]:
    names = sorted({str(s) for r in relations for s in r.free_symbols})
    return {**random_values(names, np.random.default_rng(_SEED)), **fixed}


def _determined(
    constraints: list[sp.Expr], states: list[str], point: Mapping[str, float]
) -> list[tuple[sp.Expr, str]]:
    """Independent constraints with the states they determine, by pivoting at a generic point."""
    if not constraints or not states:
        return []
    jacobian = _numbers([[c.diff(sp.Symbol(s)) for s in states] for c in constraints], point)
    chosen = _pivots(jacobian.T)
    rows = jacobian[chosen]
    columns = _pivots(rows) if len(chosen) else []
    return [(constraints[i], states[j]) for i, j in zip(chosen, columns, strict=True)]


def _independent_rows(matrix: list[list[sp.Expr]], point: Mapping[str, float]) -> list[int]:
    """Return indices of rows of full rank, the first ones preferred."""
    if not matrix:
        return []
    numbers = _numbers(matrix, point)
    chosen: list[int] = []
    for i in range(len(numbers)):
        if np.linalg.matrix_rank(numbers[[*chosen, i]], tol=_RANK) > len(chosen):
            chosen.append(i)
    return chosen


def _pivots(a: NDArray[np.float64]) -> list[int]:
    """Columns that span the columns of `a`."""
    _, r, order = sla.qr(a, mode="economic", pivoting=True)
    size = np.abs(np.diag(r)) if r.size else np.zeros(0)
    rank = int(np.sum(size > _RANK * max(float(size[0]), 1e-300))) if len(size) else 0
    return sorted(int(i) for i in order[:rank])


def _numbers(matrix: list[list[sp.Expr]], point: Mapping[str, float]) -> NDArray[np.float64]:
    return np.array([[evaluate(m, point).real for m in row] for row in matrix])


def _differentiated(constraint: sp.Expr, case: Case) -> sp.Expr:
    moving = [*case.stores, *(f"u_{n}" for n in case.inputs), *(f"du_{n}" for n in case.inputs)]
    return sp.Add(*(constraint.diff(sp.Symbol(m)) * sp.Symbol(f"d{m}") for m in moving))


def _solve(
    rows: list[sp.Expr], matrix: list[list[sp.Expr]], rates: list[sp.Symbol]
) -> dict[str, sp.Expr]:
    """Rates of the states that the rows determine."""
    if not rows:
        return {}
    zero = dict.fromkeys(rates, sp.S.Zero)
    right = [-r.xreplace(zero) for r in rows]
    found = sp.linsolve((sp.Matrix(matrix), sp.Matrix(right)), *rates)
    (solution,) = found or [()]
    free = set(rates)
    return {
        str(d)[1:]: e for d, e in zip(rates, solution, strict=False) if not e.free_symbols & free
    }
