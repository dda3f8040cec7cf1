"""Scalar functions in one vocabulary for NumPy, CasADi and SymPy.

A law is written once against an `Ops` and then serves numbers and arrays (`NUMPY`), compiled
expressions (`CASADI`, both ``SX`` and ``MX``) and derivations (`SYMPY`). CasADi and SymPy are
imported at the first call, so importing this module stays cheap.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Expression: TypeAlias = Any
"""A float, a NumPy array, a CasADi SX/MX or a SymPy expression: whatever the `Ops` works on."""

FloatArray: TypeAlias = NDArray[np.float64]

_Unary: TypeAlias = Callable[[Expression], Expression]
_Binary: TypeAlias = Callable[[Expression, Expression], Expression]
_Ternary: TypeAlias = Callable[[Expression, Expression, Expression], Expression]


@dataclass(frozen=True, slots=True)
class Ops:
    """The scalar functions a law may use, for one kind of value.

    Arithmetic and comparisons are the operators of Python; everything else comes from here.
    ``where(condition, a, b)`` evaluates both branches on every back end, so each must be defined
    on the whole domain.

    Parameters
    ----------
    name : str
        ``"numpy"``, ``"casadi"`` or ``"sympy"``.
    maximum, minimum : callable
        Elementwise, two arguments.
    absolute, sign, tanh, exp, expm1, log, sqrt, floor : callable
        Elementwise, one argument.
    where : callable
        ``where(condition, a, b)``, elementwise.
    bank : callable, optional
        Takes the place of `bondgraph.hysteresis.plays.play.sum_of_plays` where a step runs them.

    Examples
    --------
    >>> float(NUMPY.maximum(1.0, 2.0))
    2.0
    """

    name: str
    maximum: _Binary = field(repr=False)
    minimum: _Binary = field(repr=False)
    absolute: _Unary = field(repr=False)
    sign: _Unary = field(repr=False)
    tanh: _Unary = field(repr=False)
    exp: _Unary = field(repr=False)
    expm1: _Unary = field(repr=False)
    log: _Unary = field(repr=False)
    sqrt: _Unary = field(repr=False)
    floor: _Unary = field(repr=False)
    where: _Ternary = field(repr=False)
    bank: Callable[..., Expression] | None = field(default=None, repr=False)


def _late(module: str, function: str) -> Callable[..., Expression]:
    """Return a function that imports ``module`` only when it is first called."""

    def call(*arguments: Expression) -> Expression:
        return getattr(import_module(module), function)(*arguments)

    call.__name__ = call.__qualname__ = function
    return call


def _piecewise(condition: Expression, a: Expression, b: Expression) -> Expression:
    return import_module("sympy").Piecewise((a, condition), (b, True))


def _expm1(x: Expression) -> Expression:
    return import_module("sympy").exp(x) - 1


def _library(name: str, wrapped: str) -> Ops:
    """Return the functions of a library, imported at the first call, in the order of `Ops`."""
    return Ops(name, *(_late(name, function) for function in wrapped.split()))


NUMPY = Ops(
    "numpy",
    np.maximum, np.minimum, np.abs, np.sign, np.tanh, np.exp, np.expm1, np.log, np.sqrt, np.floor,
    np.where,
)  # fmt: skip
CASADI = _library("casadi", "fmax fmin fabs sign tanh exp expm1 log sqrt floor if_else")
SYMPY = replace(
    _library("sympy", "Max Min Abs sign tanh exp exp log sqrt floor Piecewise"),
    expm1=_expm1, where=_piecewise,
)  # fmt: skip
