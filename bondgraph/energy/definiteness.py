"""Exact decisions about SymPy expressions: does one vanish, what sign has a matrix."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any, Literal, TypeAlias

import sympy as sp

Sign: TypeAlias = Literal["positive definite", "positive semidefinite", "indefinite"]

MOST_MINORS = 5
"""Larger matrices of symbols are judged at numbers only: their minors grow like n!."""

_POINTS = (((3, 7), (5, 11)), ((13, 8), (2, 9)), ((7, 5), (17, 6)))


def vanishes(expression: Any) -> bool:
    """Return whether an expression is identically zero.

    Decided exactly if it is rational, or already vanishes with its functions taken as unknowns.
    Others are evaluated at three rational points to 40 digits: one that is not zero there is not
    zero, and it counts as zero if all agree to 30 digits (12 with floating-point numbers).

    Examples
    --------
    >>> x = sp.Symbol("x", real=True)
    >>> vanishes(sp.sin(x) ** 2 + sp.cos(x) ** 2 - 1), vanishes(x - 1)
    (True, False)
    """
    e = sp.sympify(expression)
    if e == 0:
        return True
    if not e.has(sp.Float):
        short = shortened(e)
        if short == 0 or not e.has(sp.Function, sp.Integral, sp.Pow, sp.Piecewise):
            return bool(short == 0)
    seen = [_small(e, i) for i in range(len(_POINTS))]
    if any(s is False for s in seen):
        return False
    if all(seen):
        return True
    return bool(sp.simplify(e) == 0)


def shortened(expression: sp.Expr) -> sp.Expr:
    """Return an expression cancelled as a rational one of its symbols and functions.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> shortened((sp.sin(x) ** 2 - 1) / (sp.sin(x) - 1))
    sin(x) + 1
    """
    if expression.is_number:
        return expression
    opaque = expression.atoms(sp.Function, sp.Integral, sp.Piecewise)
    outer = {f: sp.Dummy() for f in opaque}
    # the largest first: a function inside another one goes with it
    for f in sorted(opaque, key=sp.count_ops, reverse=True):
        expression = expression.xreplace({f: outer[f]})
    try:
        short = sp.cancel(sp.together(expression))
    except sp.PolynomialError:
        short = expression
    return short.xreplace({v: f for f, v in outer.items()})


def _small(e: sp.Expr, which: int) -> bool | None:
    """Whether `e` is zero at a rational point, within the digits carried; None if undefined."""
    (a, b), (c, d) = _POINTS[which]
    symbols = sorted(e.free_symbols, key=str)
    at = {s: sp.Rational(a, b) + i * sp.Rational(c, d) for i, s in enumerate(symbols)}
    terms = [sp.N(t.subs(at), 40) for t in sp.Add.make_args(e)]
    if not all(t.is_number and t.is_finite for t in terms):
        return None
    size = sum(abs(t) for t in terms)
    digits = 12 if e.has(sp.Float) else 30
    return bool(abs(sum(terms)) <= size * sp.Float(10) ** -digits)


def is_positive(expression: Any) -> bool | None:
    """Return whether an expression of positive symbols is positive for all their values.

    Examples
    --------
    >>> a, b = sp.symbols("a b", positive=True)
    >>> is_positive(a**2 + a * b), is_positive(a - b)
    (True, None)
    """
    e = sp.sympify(expression)
    if e.is_positive is not None:
        return bool(e.is_positive)
    try:
        found = sp.factor(sp.together(e)).is_positive
    except sp.PolynomialError:
        return None
    return None if found is None else bool(found)


def sign_of(
    matrix: sp.Matrix, values: Mapping[sp.Symbol, Any], *, may_vary: bool = True
) -> tuple[Sign, bool]:
    """Return the sign of a symmetric matrix, and whether it holds for all positive parameters.

    Parameters
    ----------
    values : dict of symbol to number
        Rational numbers of the symbols, used if the symbolic minors decide nothing.
    may_vary : bool
        Try the symbolic minors first.

    Raises
    ------
    ValueError
        An entry is not finite at `values`.
    """
    if may_vary and matrix.rows <= MOST_MINORS and (found := _by_minors(matrix)):
        return found, True
    numbers = matrix.xreplace(dict(values)).applyfunc(_rational)
    return _by_roots(numbers), not matrix.free_symbols


def _rational(v: sp.Expr) -> sp.Expr:
    if v.is_Rational:
        return v
    if not v.is_number or not v.is_finite:
        raise ValueError("not a finite matrix")
    return sp.Rational(str(sp.N(v, 40)))


def _by_minors(matrix: sp.Matrix) -> Sign | None:
    """All leading minors positive, or all principal minors positive or zero."""
    n = matrix.rows
    leading = [matrix[:k, :k].det() for k in range(1, n + 1)]
    if all(is_positive(m) for m in leading):
        return "positive definite"
    for k in range(1, n + 1):
        for rows in combinations(range(n), k):
            minor = matrix.extract(list(rows), list(rows)).det()
            if not (vanishes(minor) or is_positive(minor)):
                return None
    return "positive semidefinite"


def _by_roots(matrix: sp.Matrix) -> Sign:
    """All roots are real: none is negative if the signs of the characteristic polynomial change."""
    from sympy.polys.matrices import DomainMatrix

    found = DomainMatrix.from_Matrix(matrix).to_field().charpoly()
    least = min((-1) ** k * c for k, c in enumerate(found))
    return "indefinite" if least < 0 else "positive definite" if least else "positive semidefinite"
