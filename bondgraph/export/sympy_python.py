"""The explicit SymPy -> Python printer for the readable steps of a program."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy as sp

from bondgraph.export.tape import ATOM, PLUS, TIMES, UNARY
from bondgraph.export.tape_languages import PYTHON
from bondgraph.support.errors import BondsightError

_FUNCTIONS = {
    sp.exp: "exp",
    sp.log: "log",
    sp.tanh: "tanh",
    sp.sin: "sin",
    sp.cos: "cos",
    sp.tan: "tan",
    sp.sinh: "sinh",
    sp.cosh: "cosh",
    sp.asin: "asin",
    sp.acos: "acos",
    sp.atan: "atan",
    sp.Abs: "fabs",
}
_CHOICES = {sp.Max: "max", sp.Min: "min"}


def to_python(expression: sp.Expr, names: Mapping[str, str]) -> str:
    """Print `expression` with the identifiers of `names` for its symbols.

    Raises
    ------
    BondsightError
        A node has no rule, or a symbol no name.

    Examples
    --------
    >>> a, b = sp.symbols("a b")
    >>> to_python(sp.exp(-a) / b**2, {"a": "a", "b": "b_"})
    'safe_exp(-a) / b_**2'
    """
    return _print(expression, names)[0]


def _at(node: Any, names: Mapping[str, str], least: int) -> str:
    text, level = _print(node, names)
    return text if level >= least else f"({text})"


def _print(node: Any, names: Mapping[str, str]) -> tuple[str, int]:
    if isinstance(node, sp.Symbol):
        if node.name not in names:
            raise BondsightError(f"symbol {node} has no value here; known: {', '.join(names)}")
        return names[node.name], ATOM
    if isinstance(node, sp.Number | sp.NumberSymbol):
        text = PYTHON.number(float(node))
        return text, UNARY if text.startswith("-") else ATOM
    if isinstance(node, sp.Add):
        return _sum(node, names), PLUS
    if isinstance(node, sp.Mul):
        return _product(node, names)
    if isinstance(node, sp.Pow):
        return _power(node, names)
    if node.func in _CHOICES:
        arguments = ", ".join(_print(a, names)[0] for a in node.args)
        return f"{_CHOICES[node.func]}({arguments})", ATOM
    if node.func is sp.sign:
        inner = _at(node.args[0], names, PLUS)
        return f"(({inner} > 0.0) - ({inner} < 0.0))", ATOM
    if node.func in _FUNCTIONS:
        rule = PYTHON.rules[_FUNCTIONS[node.func]]
        return rule.template.format(_print(node.args[0], names)[0]), ATOM
    raise BondsightError(
        f"no Python rule for {type(node).__name__} in {node}; write the relation as a Law"
    )


def _sum(node: sp.Add, names: Mapping[str, str]) -> str:
    text = ""
    for term in node.args:
        part = _at(term, names, TIMES)
        if not text:
            text = part
        elif part.startswith("-"):
            text += f" - {part[1:]}"
        else:
            text += f" + {part}"
    return text


def _product(node: sp.Mul, names: Mapping[str, str]) -> tuple[str, int]:
    sign, over, under = "", [], []
    for factor in node.args:
        if factor == -1:
            sign = "-"
        elif isinstance(factor, sp.Pow) and factor.exp.is_Number and factor.exp.is_negative:
            under.append(sp.Pow(factor.base, -factor.exp))
        else:
            over.append(factor)
    text = " * ".join(_at(f, names, UNARY) for f in over) or "1.0"
    for factor in under:
        text += f" / {_at(factor, names, UNARY)}"
    single = len(over) == 1 and not under
    if single and sign and text.startswith("-"):
        text = f"({text})"
    return sign + text, TIMES


def _power(node: sp.Pow, names: Mapping[str, str]) -> tuple[str, int]:
    if node.exp == -1:
        return f"1.0 / {_at(node.base, names, UNARY)}", TIMES
    if node.exp == sp.S.Half:
        return f"safe_sqrt({_print(node.base, names)[0]})", ATOM
    if node.exp.is_Integer and 0 < int(node.exp) <= 4:
        return f"{_at(node.base, names, ATOM)}**{int(node.exp)}", UNARY
    base, exponent = (_print(a, names)[0] for a in node.args)
    return f"safe_pow({base}, {exponent})", ATOM
