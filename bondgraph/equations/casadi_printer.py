"""The explicit SymPy -> CasADi printer; nothing else turns symbols into numbers."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce, singledispatch
from typing import Any

import casadi as ca
import sympy as sp

from bondgraph.support.errors import BondsightError

Table = Mapping[sp.Symbol, Any]


def to_casadi(expression: sp.Expr, table: Table) -> Any:
    """Print `expression` with the CasADi values of `table` for its symbols.

    Raises
    ------
    BondsightError
        A node has no rule, or a symbol no value.
    """
    return _print(expression, table)


@singledispatch
def _print(node: Any, table: Table) -> Any:
    raise BondsightError(
        f"no CasADi rule for {type(node).__name__} in {node}; write the relation as a Law"
    )


@_print.register
def _number(node: sp.Number, table: Table) -> Any:
    return float(node)


@_print.register
def _constant(node: sp.NumberSymbol, table: Table) -> Any:
    return float(node)


@_print.register
def _symbol(node: sp.Symbol, table: Table) -> Any:
    if node not in table:
        raise BondsightError(
            f"symbol {node} has no value here; known: {', '.join(map(str, table))}"
        )
    return table[node]


@_print.register
def _add(node: sp.Add, table: Table) -> Any:
    total: Any = 0
    for a in node.args:
        total = total + _print(a, table)
    return total


@_print.register
def _mul(node: sp.Mul, table: Table) -> Any:
    over: Any = 1
    under: Any = 1
    for a in node.args:
        if isinstance(a, sp.Pow) and a.exp.is_Number and a.exp.is_negative:
            under = under * _print(sp.Pow(a.base, -a.exp), table)
        else:
            over = over * _print(a, table)
    return over / under


@_print.register
def _pow(node: sp.Pow, table: Table) -> Any:
    base = _print(node.base, table)
    if node.exp == -1:
        return 1 / base
    if node.exp.is_Integer and 0 < int(node.exp) <= 4:
        product = base
        for _ in range(int(node.exp) - 1):
            product = product * base
        return product
    return base ** _print(node.exp, table)


_FUNCTIONS = {
    sp.exp: ca.exp,
    sp.log: ca.log,
    sp.tanh: ca.tanh,
    sp.sin: ca.sin,
    sp.cos: ca.cos,
    sp.tan: ca.tan,
    sp.sinh: ca.sinh,
    sp.cosh: ca.cosh,
    sp.asin: ca.asin,
    sp.acos: ca.acos,
    sp.atan: ca.atan,
    sp.Abs: ca.fabs,
    sp.sign: ca.sign,
}


@_print.register
def _function(node: sp.Function, table: Table) -> Any:
    rule = _FUNCTIONS.get(node.func)
    if rule is None:
        raise BondsightError(f"no CasADi rule for the function {node.func}; write it as a Law")
    return rule(_print(node.args[0], table))


@_print.register
def _largest(node: sp.Max, table: Table) -> Any:
    return reduce(ca.fmax, (_print(a, table) for a in node.args))


@_print.register
def _smallest(node: sp.Min, table: Table) -> Any:
    return reduce(ca.fmin, (_print(a, table) for a in node.args))
