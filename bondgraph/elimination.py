"""Gaussian elimination of a small system with symbolic coefficients, without expression swell."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction

import sympy as sp

from bondgraph.elements import symbol
from bondgraph.errors import UnusableInput
from bondgraph.relations import Relation

__all__ = ["eliminate_named", "rational"]

RELATIVE = Fraction(1, 10**12)


def rational(c: sp.Expr, value: Callable[[str], Fraction]) -> Fraction:
    """Return the exact value of an expression whose symbols have exact values.

    Functions other than sums, products and integer powers are rounded to a float.

    Raises
    ------
    UnusableInput
        A division by zero.
    """
    if c.is_Symbol:
        return value(str(c))
    if c.is_Rational:
        return Fraction(int(c.p), int(c.q))
    if c.is_Float:
        return Fraction(float(c))
    if c.is_Pow and c.exp.is_Integer:
        base = rational(c.base, value)
        if not base and c.exp.is_negative:
            raise UnusableInput(f"{c} divides by zero; check the parameters")
        return base ** int(c.exp)
    if c.is_Mul:
        product = Fraction(1)
        for a in c.args:
            product *= rational(a, value)
        return product
    if c.is_Add:
        return sum((rational(a, value) for a in c.args), Fraction(0))
    number = complex(c.xreplace({s: sp.Float(float(value(str(s))), 30) for s in c.free_symbols}))
    if number.imag or number != number:
        raise UnusableInput(f"{c} has no real value at these parameters; check them")
    return Fraction(number.real)


class _Values:
    """Exact values of symbols: declared ones where `numbers` has them, else drawn once."""

    def __init__(self, numbers: Mapping[str, float]) -> None:
        self._known: dict[str, Fraction] = {}
        for n, v in numbers.items():
            if v == v and abs(v) != float("inf"):
                self._known[n] = Fraction(v)
        self._random = random.Random(20260101)

    def __call__(self, name: str) -> Fraction:
        if name not in self._known:
            self._known[name] = Fraction(self._random.randint(10**6, 10**7), 10**6 + 3)
        return self._known[name]

    def name(self, name: str, value: Fraction) -> None:
        self._known[name] = value


def eliminate_named(
    matrix: Sequence[Sequence[sp.Expr]],
    right: Sequence[str],
    unknown: Sequence[str],
    *,
    prefix: str,
    nominal: Mapping[str, float],
) -> list[Relation] | None:
    """Return assignments that solve ``matrix @ unknown = right``; None if it is singular.

    Every coefficient of the elimination gets a name, so the size stays cubic. Whether one vanishes
    is decided by exact arithmetic, at random values of the symbols and at the declared ones.

    Parameters
    ----------
    matrix : sequence of sequence of sympy.Expr, shape (n, n)
    right, unknown : sequence of str, shape (n,)
        Names of signals.
    prefix : str
        Start of the names of coefficients.
    nominal : mapping of str to float
        Declared values of parameters.
    """
    n = len(unknown)
    here, anywhere = _Values(nominal), _Values({})
    made: list[Relation] = []
    count = 0

    def named(value: sp.Expr) -> sp.Expr:
        nonlocal count
        if value.is_Symbol or value.is_Number:
            return value
        name = f"{prefix}_c{count}"
        count += 1
        for values in (here, anywhere):
            values.name(name, rational(value, values))
        made.append(Relation(name, (), "", expression=value))
        return symbol(name)

    rows = [[named(c) if c != 0 else sp.S.Zero for c in row] for row in matrix]
    rest = list(right)
    columns = list(range(n))
    for i in range(n):
        # complete pivoting on the declared values: accurate, and zero only if all the rest is
        size, r, c = max(
            ((abs(rational(rows[r][c], here)), r, c) for r in range(i, n) for c in range(i, n)),
            key=lambda v: v[0],
        )
        largest = max((abs(rational(v, here)) for v in rows[r]), default=Fraction(0))
        if size <= RELATIVE * largest or not rational(rows[r][c], anywhere):
            return None
        rows[i], rows[r] = rows[r], rows[i]
        rest[i], rest[r] = rest[r], rest[i]
        for row in rows:
            row[i], row[c] = row[c], row[i]
        columns[i], columns[c] = columns[c], columns[i]
        for r in range(i + 1, n):
            if rows[r][i] == 0:
                continue
            factor = named(rows[r][i] / rows[i][i])
            rows[r][i] = sp.S.Zero
            for c in range(i + 1, n):
                if rows[i][c] != 0:
                    value = rows[r][c] - factor * rows[i][c]
                    vanishes = not rational(value, anywhere)
                    rows[r][c] = sp.S.Zero if vanishes else named(value)
            reduced = f"{prefix}_r{count}"
            count += 1
            made.append(Relation(reduced, ((1, rest[r]), (-factor, rest[i])), ""))
            rest[r] = reduced
    for i in reversed(range(n)):
        pivot = rows[i][i]
        terms = [(1 / pivot, rest[i])]
        terms += [
            (-rows[i][c] / pivot, unknown[columns[c]]) for c in range(i + 1, n) if rows[i][c] != 0
        ]
        made.append(Relation(unknown[columns[i]], tuple(terms), ""))
    return made
