"""Sparse elimination over any exact field, and ranks over a large prime field.

A structural statement holds for almost all parameter values. At random values in a prime field a
nonzero polynomial of degree d vanishes with probability d / p at most (Schwartz 1980; Zippel 1979),
so one evaluation decides it for every practical purpose, without rounding and without growth.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any, TypeAlias

import sympy as sp

from bondgraph.equations.elimination import PRIME, echelon

Row: TypeAlias = dict[int, Any]


def solve(
    rows: Sequence[Mapping[int, Any]], right: Sequence[Mapping[int, Any]]
) -> list[Row] | None:
    """Return X of ``A X = B``, row by row, or None if A is singular.

    Pivots follow Markowitz (Management Science 3 (1957) 255): the entry that can fill in least.

    Parameters
    ----------
    rows : sequence of mapping of int to field element
        Sparse rows of the square A.
    right : sequence of mapping of int to field element
        Sparse rows of B; columns are numbered freely.
    """
    left: list[Row] = [dict(r) for r in rows]
    extra: list[Row] = [dict(r) for r in right]
    holders: dict[int, set[int]] = {}
    for i, r in enumerate(left):
        for j in r:
            holders.setdefault(j, set()).add(i)
    pivots: list[tuple[int, int]] = []
    alive = set(range(len(left)))
    while alive:
        i, j = _pivot(left, holders, alive)
        if j < 0:
            return None
        alive.discard(i)
        pivots.append((i, j))
        for k in tuple(holders[j]):
            if k in alive:
                factor = -(left[k][j] / left[i][j])
                for c in _combine(left[k], left[i], factor):
                    if c in left[k]:
                        holders.setdefault(c, set()).add(k)
                    else:
                        holders[c].discard(k)
                _combine(extra[k], extra[i], factor)
    solution: list[Row] = [{} for _ in left]
    for i, j in reversed(pivots):
        total = dict(extra[i])
        for c, v in left[i].items():
            if c != j:
                _combine(total, solution[c], -v)
        solution[j] = {c: v / left[i][j] for c, v in total.items()}
    return solution


def _pivot(left: list[Row], holders: dict[int, set[int]], alive: set[int]) -> tuple[int, int]:
    best = (-1, -1)
    least: tuple[int, int] | None = None
    counts: dict[int, int] = {}
    for i in alive:
        own = len(left[i]) - 1
        if own < 0:
            return i, -1
        for j in left[i]:
            if j not in counts:
                counts[j] = len(holders[j] & alive)
            cost = (own * (counts[j] - 1), _weight(left[i][j]))
            if least is None or cost < least:
                least, best = cost, (i, j)
    return best


def _weight(value: Any) -> int:
    """Length of a pivot: the shorter, the shorter what it divides."""
    numerator = getattr(value, "numer", None)
    return 0 if numerator is None else len(numerator) + len(value.denom)


def _combine(row: Row, other: Mapping[int, Any], factor: Any) -> list[int]:
    """Add ``factor * other`` to `row` in place; return the columns touched."""
    for c, v in other.items():
        new = row[c] + factor * v if c in row else factor * v
        if new:
            row[c] = new
        else:
            row.pop(c, None)
    return list(other)


def generic_values(names: Iterable[str], seed: int = 20240607) -> dict[str, Fraction]:
    """Return reproducible random rational values, one a name."""
    draw = random.Random(seed)
    return {n: Fraction(draw.randint(10**4, 10**6), draw.randint(10**4, 10**6)) for n in names}


def modular(value: Fraction | int, modulus: int = PRIME) -> int:
    """Return a rational number in the prime field, or modulo a power of the prime."""
    f = Fraction(value)
    return f.numerator * pow(f.denominator, -1, modulus) % modulus


def rank(rows: Iterable[Sequence[int]]) -> int:
    """Return the rank over the prime field.

    Examples
    --------
    >>> rank([[1, 2], [2, 4]])
    1
    """
    return len(echelon(rows))


def rational(expression: Any) -> sp.Expr:
    """Return an expression with every float as the decimal number that was written."""
    e = sp.sympify(expression)
    return e.xreplace({f: sp.Rational(str(f)) for f in e.atoms(sp.Float)})
