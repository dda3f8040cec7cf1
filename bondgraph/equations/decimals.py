"""Equations as a reader wants them: decimals for long fractions, space between factors."""

from __future__ import annotations

import sympy as sp
from sympy.core.alphabets import greeks

DIGITS = 12
"""Significant digits that are shown: those beyond are rounding noise of what a user wrote."""


BETWEEN = r" \, "
"""Stands between factors in LaTeX: without it, ``b`` by ``belt`` reads as one name."""


def spaced(expression: sp.Basic) -> str:
    r"""Return an expression as LaTeX, with space between factors where a name is a word.

    Examples
    --------
    >>> spaced(sp.Symbol("leak") * sp.Symbol("oil"))
    'leak \\, oil'
    """
    apart = BETWEEN if any(map(is_word, expression.free_symbols)) else None
    return str(sp.latex(expression, mul_symbol=apart))


def is_word(name: sp.Symbol) -> bool:
    """Whether a name is set as several letters in a row; Greek ones are one."""
    head = str(name).strip("_").partition("_")[0]
    return len(head.rstrip("0123456789")) > 1 and head.lower() not in greeks


def decimals(expression: sp.Expr) -> sp.Expr:
    """Return an expression to be shown, with decimals in place of its long fractions.

    Equations hold the floats of a model as exact fractions. Those that a reader would rather see
    as a decimal become one of 12 digits; small fractions such as 1/2 or 10/19, and integers, stay.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> decimals(x / 2 - sp.Rational(repr(-80 * 9.81)))
    x/2 + 784.8
    """
    long = {r: sp.Float(r, DIGITS) for r in expression.atoms(sp.Rational) if _is_long(r)}
    return expression.xreplace(long)


def as_text(expression: sp.Expr) -> str:
    """Return an expression as text, see `decimals`.

    Examples
    --------
    >>> as_text(sp.Rational("-9.8100000000000005"))
    '-9.81'
    """
    return str(sp.sstr(decimals(expression), full_prec=False))


def _is_long(number: sp.Rational) -> bool:
    """Whether a fraction reads worse than its decimal, which may end (12 digits) or not."""
    p, q = abs(int(number.p)), int(number.q)
    ends = pow(10, q.bit_length(), q) == 0
    return q > 1 and (max(p, 10 * q) >= 100 if ends else max(p, q) >= 1000)
