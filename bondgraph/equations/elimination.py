"""Gaussian elimination with symbolic coefficients, sparse and without expression swell.

Every coefficient gets a name and two numbers: a float at the declared values, which chooses pivots,
and its residue modulo a large prime at random values of the symbols, which decides exactly (but for
one chance in 10^18) whether it vanishes identically.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import sympy as sp

from bondgraph.equations.relation import Relation
from bondgraph.graph.parameter import symbol
from bondgraph.support.errors import UnusableInput

PRIME = 2**61 - 1
"""A Mersenne prime: the field in which ranks are taken."""
SMALL = 1e-13
THRESHOLD = 0.1


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


class Residues:
    """Values of expressions modulo a prime, at random values of their symbols."""

    def __init__(self) -> None:
        self._residue: dict[object, int] = {}
        self._random = random.Random(20260101)

    def of(self, c: Any) -> int:
        """Return the residue of a number or an expression."""
        return self.residue(sp.sympify(c))

    def residue(self, c: sp.Expr) -> int:
        """Return the value modulo a prime at random values of the symbols."""
        if c.is_Rational:
            return int(c.p) * pow(int(c.q), -1, PRIME) % PRIME
        if c.is_Float:
            exact = Fraction(float(c))
            return exact.numerator * pow(exact.denominator, -1, PRIME) % PRIME
        if c.is_Pow and c.exp.is_Integer:
            base = self.residue(c.base)
            return pow(base, int(c.exp), PRIME) if base else 0
        if c.is_Mul:
            product = 1
            for a in c.args:
                product = product * self.residue(a) % PRIME
            return product
        if c.is_Add:
            return sum(self.residue(a) for a in c.args) % PRIME
        # a symbol, or a function that is taken as independent of everything else
        key: object = str(c) if c.is_Symbol else c
        if key not in self._residue:
            self._residue[key] = self._random.randrange(1, PRIME)
        return self._residue[key]


def echelon(rows: Iterable[Sequence[int]]) -> list[tuple[int, list[int]]]:
    """Return the reduced row echelon form over the prime field as (pivot column, row)."""
    found: list[tuple[int, list[int]]] = []
    for given in rows:
        row = [v % PRIME for v in given]
        for column, known in found:
            if row[column]:
                f = row[column]
                row = [(v - f * k) % PRIME for v, k in zip(row, known, strict=True)]
        pivot = next((c for c, v in enumerate(row) if v), None)
        if pivot is None:
            continue
        scale = pow(row[pivot], -1, PRIME)
        row = [v * scale % PRIME for v in row]
        for n, (column, known) in enumerate(found):
            if known[pivot]:
                f = known[pivot]
                changed = [(v - f * k) % PRIME for v, k in zip(known, row, strict=True)]
                found[n] = (column, changed)
        found.append((pivot, row))
    return sorted(found, key=lambda t: t[0])


class _Numbers(Residues):
    """Float and residue of coefficients; symbols without a declared value get random ones."""

    def __init__(self, nominal: Mapping[str, float]) -> None:
        super().__init__()
        self._float = {n: v for n, v in nominal.items() if v == v and abs(v) != float("inf")}

    def name(self, name: str, near: float, residue: int) -> None:
        """Give a named coefficient its numbers."""
        self._float[name] = near
        self._residue[name] = residue

    def near(self, c: sp.Expr) -> float:
        """Return the value at the declared parameters."""
        if c.is_Symbol:
            return self._float.setdefault(str(c), self._random.uniform(0.5, 2.0))
        put = {s: sp.Float(self.near(s)) for s in c.free_symbols}
        value = complex(c.xreplace(put)) if put else complex(c)
        return value.real if not value.imag else float("nan")


def eliminate_named(
    matrix: Sequence[Mapping[int, sp.Expr]],
    right: Sequence[str],
    unknown: Sequence[str],
    *,
    prefix: str,
    nominal: Mapping[str, float],
) -> list[Relation] | None:
    """Return assignments that solve ``matrix @ unknown = right``; None if it is singular.

    Pivots are large enough and spare fill-in (Markowitz, Management Science 3 (1957) 255), so that
    a chain of loops costs as much as it is long.

    Parameters
    ----------
    matrix : sequence of mappings of int to sympy.Expr, shape (n, n)
        Entries by column; those left out are zero.
    right, unknown : sequence of str, shape (n,)
        Names of signals.
    prefix : str
        Start of the names of coefficients.
    nominal : mapping of str to float
        Declared values of parameters.
    """
    numbers = _Numbers(nominal)
    made: list[Relation] = []
    count = 0

    def named(value: sp.Expr) -> tuple[sp.Expr, float] | None:
        """Name a coefficient; None if it vanishes identically."""
        nonlocal count
        residue = numbers.residue(value)
        if residue == 0:
            return None
        near = numbers.near(value)
        if value.is_Symbol or value.is_Number:
            return value, near
        name = f"{prefix}_c{count}"
        count += 1
        numbers.name(name, near, residue)
        made.append(Relation(name, (), "", expression=value))
        return symbol(name), near

    rows: dict[int, dict[int, tuple[sp.Expr, float]]] = {}
    columns: dict[int, set[int]] = {j: set() for j in range(len(unknown))}
    for i, row in enumerate(matrix):
        rows[i] = {}
        for j, c in row.items():
            kept = named(sp.sympify(c))
            if kept is not None:
                rows[i][j] = kept
                columns[j].add(i)
    rest = list(right)
    order: list[tuple[int, int]] = []
    done: dict[int, dict[int, tuple[sp.Expr, float]]] = {}
    while rows:
        pivot = _pivot(rows, columns)
        if pivot is None:
            return None
        i, j = pivot
        row = rows.pop(i)
        for c in row:
            columns[c].discard(i)
        top, _ = row[j]
        for r in sorted(columns.pop(j)):
            factor = named(rows[r].pop(j)[0] / top)
            if factor is None:
                continue
            for c, (value, _) in row.items():
                if c == j:
                    continue
                old = rows[r].get(c)
                kept = named((old[0] if old else sp.S.Zero) - factor[0] * value)
                if kept is None:
                    rows[r].pop(c, None)
                    columns[c].discard(r)
                else:
                    rows[r][c] = kept
                    columns[c].add(r)
            reduced = f"{prefix}_r{count}"
            count += 1
            made.append(Relation(reduced, ((1, rest[r]), (-factor[0], rest[i])), ""))
            rest[r] = reduced
        order.append((i, j))
        done[i] = row
    for i, j in reversed(order):
        top, _ = done[i][j]
        terms = [(1 / top, rest[i])]
        terms += [(-value / top, unknown[c]) for c, (value, _) in done[i].items() if c != j]
        made.append(Relation(unknown[j], tuple(terms), ""))
    return made


def _pivot(
    rows: Mapping[int, Mapping[int, tuple[sp.Expr, float]]], columns: Mapping[int, set[int]]
) -> tuple[int, int] | None:
    """Return the entry that spares most fill-in among those large enough in their row."""
    best: tuple[int, float, int, int] | None = None
    for i, row in rows.items():
        largest = max((abs(v) for _, v in row.values()), default=0.0)
        for j, (_, value) in row.items():
            if not abs(value) >= max(THRESHOLD * largest, SMALL * largest) or value == 0.0:
                continue
            cost = (len(row) - 1) * (len(columns[j]) - 1)
            if best is None or (cost, -abs(value) / largest, i, j) < best:
                best = (cost, -abs(value) / largest, i, j)
        if best is not None and best[0] == 0:
            break
    return None if best is None else (best[2], best[3])
