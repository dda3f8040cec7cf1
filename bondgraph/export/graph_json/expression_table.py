"""The operations that an expression in a file may use, and what its names mean."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.support.errors import UnusableInput

MANY = 1000
MAX_NODES_IN_ALL = 200_000


@dataclass
class Symbols:
    """What names in expressions mean: declared parameters, values of elements, otherwise signals.

    Attributes
    ----------
    parameters : mapping of str to Parameter
        Declared ones.
    values : mapping of str to (float or None)
        Elements with a coefficient, and their number if they have one.
    nodes : int
        Nodes read so far; bounded over the whole graph.
    """

    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    values: Mapping[str, float | None] = field(default_factory=dict)
    nodes: int = 0

    def __getitem__(self, name: str) -> sp.Symbol:
        """Return the symbol of a name."""
        if name in self.parameters:
            return self.parameters[name].symbol
        return symbol(name, positive=name in self.values)

    def nominal(self, name: str) -> float | None:
        """Return the number a name stands for, None for a signal."""
        if name in self.parameters:
            return float(self.parameters[name].value)
        found = self.values.get(name)
        return None if found is None else float(found)

    def count(self, place: str) -> None:
        """Count one more node."""
        self.nodes += 1
        if self.nodes > MAX_NODES_IN_ALL:
            raise UnusableInput(
                f"{place}: the expressions have more than {MAX_NODES_IN_ALL} terms in all; "
                "declare parameters for repeated parts"
            )


@dataclass(frozen=True, slots=True)
class Operation:
    """How many operands an operation takes, how SymPy builds it and how a double is computed."""

    least: int
    most: int
    build: Callable[..., Any]
    compute: Callable[..., float]


def _function(cls: Any, compute: Callable[..., float], n: int = 1, most: int = 0) -> Operation:
    # not evaluated: SymPy would try to simplify, which may take long for a large operand
    return Operation(n, most or n, lambda *a: cls(*a, evaluate=False), compute)


def _where(*branches: Any) -> Any:
    """``["where", condition, value, .., otherwise]`` as a piecewise expression."""
    pairs = list(zip(branches[:-1:2], branches[1:-1:2], strict=True))
    return sp.Piecewise(*((v, c) for c, v in pairs), (branches[-1], True), evaluate=False)


def _choose(*branches: float) -> float:
    pairs = zip(branches[:-1:2], branches[1:-1:2], strict=True)
    return next((v for c, v in pairs if c), branches[-1])


_FUNCTIONS: Mapping[str, tuple[Any, Callable[..., float]]] = {
    "exp": (sp.exp, math.exp),
    "log": (sp.log, math.log),
    "sin": (sp.sin, math.sin),
    "cos": (sp.cos, math.cos),
    "tan": (sp.tan, math.tan),
    "asin": (sp.asin, math.asin),
    "acos": (sp.acos, math.acos),
    "atan": (sp.atan, math.atan),
    "sinh": (sp.sinh, math.sinh),
    "cosh": (sp.cosh, math.cosh),
    "tanh": (sp.tanh, math.tanh),
    "abs": (sp.Abs, abs),
    "sign": (sp.sign, lambda a: float(a > 0) - float(a < 0)),
}
_RELATIONS: Mapping[str, tuple[Any, Callable[..., float]]] = {
    "<": (sp.StrictLessThan, lambda a, b: float(a < b)),
    "<=": (sp.LessThan, lambda a, b: float(a <= b)),
    ">": (sp.StrictGreaterThan, lambda a, b: float(a > b)),
    ">=": (sp.GreaterThan, lambda a, b: float(a >= b)),
}
OPERATIONS: Mapping[str, Operation] = {
    "+": Operation(1, MANY, sp.Add, lambda *a: math.fsum(a)),
    "*": Operation(1, MANY, sp.Mul, lambda *a: math.prod(a)),
    "-": Operation(
        1,
        2,
        lambda a, b=None: -a if b is None else a - b,
        lambda a, b=None: -a if b is None else a - b,
    ),
    "/": Operation(2, 2, lambda a, b: a / b, lambda a, b: a / b),
    "^": Operation(2, 2, sp.Pow, math.pow),
    "sqrt": Operation(1, 1, sp.sqrt, math.sqrt),
    **{name: _function(*pair) for name, pair in _FUNCTIONS.items()},
    "atan2": _function(sp.atan2, math.atan2, 2),
    "min": _function(sp.Min, min, 2, MANY),
    "max": _function(sp.Max, max, 2, MANY),
    **{name: _function(*pair, 2) for name, pair in _RELATIONS.items()},
    "where": Operation(3, 99, _where, _choose),
}
"""Operations of an expression; ``["pi"]`` and ``["e"]`` are the constants."""
CONSTANTS: Mapping[str, tuple[Any, float]] = {"pi": (sp.pi, math.pi), "e": (sp.E, math.e)}
NAMES = {cls: name for name, (cls, _) in (*_FUNCTIONS.items(), *_RELATIONS.items())} | {
    sp.Add: "+",
    sp.Mul: "*",
    sp.Pow: "^",
    sp.atan2: "atan2",
    sp.Min: "min",
    sp.Max: "max",
}
