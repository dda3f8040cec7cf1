"""Arithmetic read from text without running it: whitelisted syntax nodes, bounded powers."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from typing import Any

import sympy as sp

from bondgraph.support.errors import UnusableInput

FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "exp": sp.exp,
    "log": sp.log,
    "sin": sp.sin,
    "cos": sp.cos,
}
_LONGEST = 20_000
_HIGHEST_POWER = 256
_UNREADABLE = (SyntaxError, ValueError, RecursionError, MemoryError)


def read_expression(text: str) -> sp.Expr:
    """Read ``+ - * / **``, parentheses, names, numbers, ``exp``, ``log``, ``sin`` and ``cos``.

    Parameters
    ----------
    text : str
        One expression. Names become plain SymPy symbols; decimal numbers become exact fractions.

    Returns
    -------
    sympy.Expr

    Raises
    ------
    UnusableInput
        Anything else: attributes, other calls, strings, comparisons, huge powers, a division by
        zero.

    Examples
    --------
    >>> read_expression("0.5*exp(-a)")
    exp(-a)/2
    """
    if len(text) > _LONGEST:
        raise UnusableInput(f"an expression of {len(text)} characters; at most {_LONGEST} are read")
    try:
        tree = ast.parse(text.strip(), mode="eval")
        value = _expression(tree.body, 1.0)
    except UnusableInput as error:
        raise UnusableInput(f"cannot read {_short(text)!r}: {error}") from None
    except _UNREADABLE:
        raise UnusableInput(
            f"cannot read {_short(text)!r}: it is not an arithmetic expression"
        ) from None
    if value.has(sp.zoo, sp.nan, sp.oo):
        raise UnusableInput(f"cannot read {_short(text)!r}: it divides by zero")
    return value


def _expression(node: ast.expr, power: float) -> sp.Expr:
    """Value of a node that stands under the exponent `power` (its growth is bounded by it)."""
    if isinstance(node, ast.Name):
        return sp.Symbol(node.id)
    if isinstance(node, ast.Constant):
        return _number(node.value)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        value = _expression(node.operand, power)
        return -value if isinstance(node.op, ast.USub) else value
    if isinstance(node, ast.BinOp):
        return _binary(node, power)
    if isinstance(node, ast.Call):
        return _call(node)
    raise UnusableInput(f"{type(node).__name__} is not allowed; use + - * / ** and functions")


def _binary(node: ast.BinOp, power: float) -> sp.Expr:
    if isinstance(node.op, ast.Pow):
        exponent = _expression(node.right, 1.0)
        if exponent.is_number:
            if not exponent.is_Rational:
                raise UnusableInput(f"the power {exponent} is not a plain number")
            power *= max(1.0, abs(float(exponent)))
            if power > _HIGHEST_POWER:
                raise UnusableInput(f"powers beyond {_HIGHEST_POWER} are not read")
        return sp.Pow(_expression(node.left, power), exponent)
    left, right = _expression(node.left, power), _expression(node.right, power)
    if isinstance(node.op, ast.Add):
        return left + right
    if isinstance(node.op, ast.Sub):
        return left - right
    if isinstance(node.op, ast.Mult):
        return left * right
    if isinstance(node.op, ast.Div):
        return left / right
    raise UnusableInput(f"{type(node.op).__name__} is not allowed; use + - * / **")


def _call(node: ast.Call) -> sp.Expr:
    if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
        raise UnusableInput(f"only the functions {', '.join(FUNCTIONS)} are known")
    if len(node.args) != 1 or node.keywords or isinstance(node.args[0], ast.Starred):
        raise UnusableInput(f"{node.func.id} takes one argument")
    return FUNCTIONS[node.func.id](_expression(node.args[0], 1.0))


def _number(value: object) -> sp.Expr:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UnusableInput(f"{value!r} is not a real number")
    if not math.isfinite(value):
        raise UnusableInput(f"{value!r} is not finite")
    return sp.Rational(repr(value))


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= 60 else line[:57] + "..."
