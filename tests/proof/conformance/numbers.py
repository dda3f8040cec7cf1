"""Numbers out of SymPy trees without compiling them, and random points to compare at."""

from __future__ import annotations

import cmath
from collections.abc import Iterable, Mapping

import numpy as np
import sympy as sp

from bondgraph.support.errors import UnusableInput

_FUNCTIONS = {sp.exp: cmath.exp, sp.log: cmath.log, sp.sin: cmath.sin, sp.cos: cmath.cos}


def evaluate(expression: sp.Expr, values: Mapping[str, complex]) -> complex:
    """Value of an expression, its symbols found by their names.

    Parameters
    ----------
    expression : sympy.Expr
        Sums, products, powers and the functions exp, log, sin, cos.
    values : dict of str to complex

    Returns
    -------
    complex
        ``nan`` where it divides by zero or overflows.

    Examples
    --------
    >>> evaluate(sp.Symbol("a") ** 2 + 1, {"a": 2.0})
    (5+0j)
    """
    try:
        return _value(expression, values, {})
    except (ZeroDivisionError, OverflowError, ValueError):
        return complex(np.nan)


def random_values(names: Iterable[str], random: np.random.Generator) -> dict[str, float]:
    """Positive numbers of ordinary size for every name: generic, and logarithms exist."""
    return {n: float(random.uniform(0.4, 1.9)) for n in names}


def _value(e: sp.Expr, values: Mapping[str, complex], known: dict[sp.Expr, complex]) -> complex:
    if e in known:
        return known[e]
    if e.is_Symbol:
        if str(e) not in values:
            raise UnusableInput(f"{e} has no value")
        result = complex(values[str(e)])
    elif e.is_Add:
        result = sum((_value(a, values, known) for a in e.args), 0j)
    elif e.is_Mul:
        result = 1 + 0j
        for a in e.args:
            result *= _value(a, values, known)
    elif e.is_Pow and e.base != sp.E:
        result = _value(e.base, values, known) ** _power(e.exp, values, known)
    elif e.is_Number or e.is_NumberSymbol or e is sp.I:
        result = complex(e)
    elif e.func in _FUNCTIONS:
        result = complex(_FUNCTIONS[e.func](_value(e.args[0], values, known)))
    else:
        raise UnusableInput(f"{e.func.__name__} is not evaluated here")
    known[e] = result
    return result


def _power(e: sp.Expr, values: Mapping[str, complex], known: dict[sp.Expr, complex]) -> complex:
    if e.is_Integer:
        return int(e)
    return _value(e, values, known)
