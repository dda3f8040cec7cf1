"""Expressions of parameters and signals as nested lists, such as ``["+", "a", ["*", 2, "b"]]``.

A list starts with an operation of a fixed table; a text is a symbol, a number itself. Nothing is
parsed or evaluated as text. SymPy computes with exact integers, so powers of powers could grow
without end; a tree whose numbers could grow so, or whose value at the nominal parameters is beyond
a double, is refused before it is built.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import sympy as sp

from bondgraph.export.graph_json.expression_table import (
    CONSTANTS,
    NAMES,
    OPERATIONS,
    Operation,
    Symbols,
)
from bondgraph.graph.parameter import symbol
from bondgraph.support.bounds import Name, Signal
from bondgraph.support.errors import UnusableInput
from bondgraph.support.typed_reader import bad, hint, read, shown

MAX_NODES = 2000
MAX_DEPTH = 40
MAX_POWER = 100
MAX_BITS = 8192
"""Bound on the digits that expanding an expression could need."""
_FLOAT_BITS = 1


@dataclass(frozen=True, slots=True)
class _Node:
    """A built part: SymPy's form, its nominal value if known, and a bound on its digits."""

    form: Any
    value: float | None
    bits: int


def read_expression(value: Any, place: str, symbols: Symbols) -> Any:
    """Return a number, the name of a declared parameter, or an expression."""
    if isinstance(value, str):
        return read(Name, value, place)
    if not isinstance(value, list):
        return read(float, value, place)
    start = symbols.nodes
    found = _node(value, place, symbols, start, 0)
    if _is_condition(found.form):
        raise bad(place, value, "a value but a condition; put it into 'where'")
    return found.form


def _node(value: Any, place: str, symbols: Symbols, start: int, depth: int) -> _Node:
    symbols.count(place)
    if symbols.nodes - start > MAX_NODES or depth > MAX_DEPTH:
        raise UnusableInput(
            f"{place}: an expression with more than {MAX_NODES} terms or {MAX_DEPTH} levels; "
            "declare parameters for its parts"
        )
    if isinstance(value, str):
        name = read(Name, value, place)
        return _Node(symbols[name], symbols.nominal(name), 1)
    if not isinstance(value, list):
        return _number(read(float, value, place))
    if not value or not isinstance(value[0], str):
        raise bad(place, value[0] if value else value, 'an operation, as in ["+", "a", 2]')
    name, rest = value[0], value[1:]
    if name == "symbol":
        return _named(rest, place, symbols)
    if name in CONSTANTS:
        if rest:
            raise UnusableInput(f"{place}: {name!r} takes no operands")
        return _Node(*CONSTANTS[name], 1)
    operation = OPERATIONS.get(name)
    if operation is None:
        raise UnusableInput(
            f"{place}: no operation {shown(name)}{hint(name, (*OPERATIONS, *CONSTANTS, 'symbol'))}"
        )
    if not operation.least <= len(rest) <= operation.most or (
        name == "where" and len(rest) % 2 == 0
    ):
        many = f"{operation.least}" + f" to {operation.most}" * (operation.most > operation.least)
        raise UnusableInput(f"{place}: {name!r} takes {many} operands, not {len(rest)}")
    parts = [_node(v, f"{place}[{i}]", symbols, start, depth + 1) for i, v in enumerate(rest, 1)]
    _check_truths(name, parts, place)
    bits = _bits(name, parts, place)
    if bits > MAX_BITS:
        raise UnusableInput(
            f"{place}: the numbers of this expression could grow to {bits} bits; write them as "
            "decimal numbers, or use smaller powers"
        )
    value_now = _computed(operation, parts, place)
    return _Node(_built(operation, parts, place), value_now, max(bits, 1))


def _number(value: float | int) -> _Node:
    if isinstance(value, int):
        return _Node(sp.Integer(value), float(value), value.bit_length() + 1)
    return _Node(sp.Float(value), value, _FLOAT_BITS)


def _named(rest: list[Any], place: str, symbols: Symbols) -> _Node:
    if len(rest) != 2 or rest[1] not in ("positive", "real"):
        raise UnusableInput(f'{place}: write ["symbol", name, "positive" or "real"]')
    name = read(Signal, rest[0], place)
    return _Node(symbol(name, positive=rest[1] == "positive"), symbols.nominal(name), 1)


def _is_condition(form: Any) -> bool:
    return isinstance(form, sp.logic.boolalg.BooleanAtom | sp.core.relational.Relational)


def _check_truths(name: str, parts: list[_Node], place: str) -> None:
    for i, part in enumerate(parts):
        condition = _is_condition(part.form)
        wanted = name == "where" and i % 2 == 0 and i < len(parts) - 1
        if condition != wanted:
            text = 'a condition such as ["<", "a", 1]' if wanted else "a value, but a condition"
            raise UnusableInput(f"{place}[{i + 1}]: operand {i + 1} of {name!r} is not {text}")


def _bits(name: str, parts: list[_Node], place: str) -> int:
    if name != "^":
        return sum(p.bits for p in parts)
    exponent = parts[1].form
    if not exponent.is_number:
        return parts[0].bits + parts[1].bits
    size = parts[1].value
    if size is None or abs(size) > MAX_POWER:
        raise UnusableInput(
            f"{place}: the power {shown(size)} is not within {MAX_POWER}; give a smaller one"
        )
    return math.ceil(parts[0].bits * max(abs(size), 1.0)) + parts[1].bits


def _computed(operation: Operation, parts: list[_Node], place: str) -> float | None:
    values = [p.value for p in parts]
    if any(v is None for v in values):
        return None
    try:
        found = operation.compute(*values)
    except OverflowError:
        found = math.inf
    except (ValueError, ZeroDivisionError):
        if all(p.form.is_number for p in parts if isinstance(p.form, sp.Expr)):
            raise UnusableInput(
                f"{place}: this has no real value, such as 1/0 or log(-1)"
            ) from None
        return None
    if not math.isfinite(found):
        raise UnusableInput(
            f"{place}: its value at the nominal parameters is beyond a double; check the expression"
        )
    return found


def _built(operation: Operation, parts: list[_Node], place: str) -> Any:
    try:
        form = operation.build(*(p.form for p in parts))
    except (TypeError, ValueError, ArithmeticError, RecursionError) as error:
        raise UnusableInput(f"{place}: cannot be built ({type(error).__name__})") from None
    if form in (sp.nan, sp.zoo, sp.oo, -sp.oo) or (isinstance(form, sp.Expr) and form.has(sp.I)):
        raise UnusableInput(f"{place}: this has no real value, such as 1/0 or log(-1)")
    return form


def write_expression(value: sp.Basic, place: str, symbols: Symbols) -> list[Any]:
    """Return an expression as nested lists."""
    if not isinstance(value, sp.Expr):
        raise bad(place, str(value), "a number, a name or a SymPy expression")
    if isinstance(value, sp.Symbol):
        return _explicit(value, place)
    tree = _tree(value, place, symbols, 0)
    return tree if isinstance(tree, list) else ["+", tree]


def _explicit(node: sp.Symbol, place: str) -> list[Any]:
    name = read(Signal, str(node), place)
    for assumption in ("positive", "real"):
        if node == symbol(name, positive=assumption == "positive"):
            return ["symbol", name, assumption]
    raise UnusableInput(
        f"{place}: the symbol {name!r} was not made by Bondsight; use graph.parameter or "
        "bondgraph.graph.modulation"
    )


def _tree(node: Any, place: str, symbols: Symbols, depth: int) -> Any:
    if depth > MAX_DEPTH:
        raise UnusableInput(f"{place}: an expression of more than {MAX_DEPTH} levels")
    if isinstance(node, sp.Symbol):
        name = str(node)
        return name if node == symbols[name] and name.isidentifier() else _explicit(node, place)
    if isinstance(node, sp.Integer):
        return read(float, int(node), place)
    if isinstance(node, sp.Rational):
        return ["/", *(read(float, int(n), place) for n in (node.p, node.q))]
    if isinstance(node, sp.Float):
        return _float(node, place, symbols)
    for name, (constant, _) in CONSTANTS.items():
        if node == constant:
            return [name]

    def parts(nodes: Any) -> list[Any]:
        return [_tree(n, place, symbols, depth + 1) for n in nodes]

    if isinstance(node, sp.Piecewise) and node.args[-1][1] == sp.true:
        flat = [n for pair in node.args[:-1] for n in (pair[1], pair[0])]
        return ["where", *parts([*flat, node.args[-1][0]])]
    operation = NAMES.get(node.func)
    if operation is None:
        raise UnusableInput(
            f"{place}: {node.func.__name__} has no place in a file; known: {', '.join(OPERATIONS)}"
        )
    return [operation, *parts(node.args)]


def _float(node: sp.Float, place: str, symbols: Symbols) -> float:
    value = float(node)
    if sp.Float(value) != node:
        raise UnusableInput(
            f"{place}: {shown(str(node))} has not the precision of a double; use Float(float(x))"
        )
    return float(read(float, value, place))
