"""Sine and cosine for laws, on every back end."""

from __future__ import annotations

from importlib import import_module

from bondgraph.support.ops import Expression, Ops

__all__ = ["cosine", "sine"]


def sine(ops: Ops, x: Expression) -> Expression:
    """Return the sine of `x`, rad.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(sine(NUMPY, 0.0))
    0.0
    """
    return import_module(ops.name).sin(x)


def cosine(ops: Ops, x: Expression) -> Expression:
    """Return the cosine of `x`, rad.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(cosine(NUMPY, 0.0))
    1.0
    """
    return import_module(ops.name).cos(x)
