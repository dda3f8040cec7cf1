"""Sine and cosine for laws, on every back end."""

from __future__ import annotations

from importlib import import_module

from bondgraph.graph.parameter import Parameter
from bondgraph.support.ops import Expression, Ops


def sine(ops: Ops, x: Expression) -> Expression:
    """Return the sine of `x`, rad.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(sine(NUMPY, 0.0))
    0.0
    """
    return import_module(ops.name).sin(x)


def amplitudes(element: str, unit: str, size: float) -> tuple[Parameter, Parameter]:
    """Return the amplitudes ``a`` and ``b`` of `wave` as parameters, 0 at first."""
    a, b = (Parameter(f"{n}_{element}", 0.0, unit, positive=False, scale=size) for n in "ab")
    return a, b


def wave(ops: Ops, x: Expression, a: Expression, b: Expression) -> Expression:
    """Return ``a sin x + b cos x``.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(wave(NUMPY, 0.0, 1.0, 2.0))
    2.0
    """
    return a * sine(ops, x) + b * import_module(ops.name).cos(x)
