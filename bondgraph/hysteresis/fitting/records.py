"""Checks of the records a fit is given; every message names the culprit."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.checks import require_finite
from bondgraph.hysteresis.errors import BadInput
from bondgraph.support.ops import FloatArray


def _record(name: str, values: ArrayLike) -> FloatArray:
    record = np.asarray(values, dtype=np.float64)
    if record.ndim != 1 or record.size == 0:
        raise BadInput(f"{name} must have shape (N,) with N >= 1, not {record.shape}")
    require_finite(name, record)
    return record


def paired_records(
    x: ArrayLike, y: ArrayLike, names: tuple[str, str] = ("x", "y")
) -> tuple[FloatArray, FloatArray]:
    """Return input and output of a fit as float arrays of one length.

    Parameters
    ----------
    x, y : array
        Shape (N,).
    names : tuple of str, optional
        What to call them in errors.

    Returns
    -------
    tuple of array
        Both of shape (N,).

    Raises
    ------
    BadInput
        If a record is empty, not one-dimensional, constant or not finite (names the first sample),
        or if the lengths differ.

    Examples
    --------
    >>> paired_records([0, 1], [0, 2])[1].tolist()
    [0.0, 2.0]
    """
    pair = _record(names[0], x), _record(names[1], y)
    if pair[0].size != pair[1].size:
        raise BadInput(
            f"{names[0]} has {pair[0].size} samples but {names[1]} has {pair[1].size}; cut both "
            "to the same instants"
        )
    for name, record in zip(names, pair, strict=True):
        if record.min() == record.max():
            raise BadInput(
                f"{name} is constant at {record[0]:g}; nothing can be learnt from a record "
                "without movement"
            )
    return pair


def require_rising(x: FloatArray, y: FloatArray, names: tuple[str, str] = ("x", "y")) -> None:
    """Raise if the output goes down when the input goes up.

    Operators with positive slopes rise and fall with their input, so ``sum dx dy`` is positive.

    Parameters
    ----------
    x, y : array
        Shape (N,).
    names : tuple of str, optional
        What to call them in the error.

    Raises
    ------
    BadInput
        If the sum is negative.

    Examples
    --------
    >>> require_rising(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    """
    if float(np.diff(x) @ np.diff(y)) < 0.0:
        raise BadInput(
            f"{names[1]} falls where {names[0]} rises (the sum of their increments' products is "
            f"negative), which positive slopes cannot follow; fit -{names[1]}, or exchange the "
            "records if they are swapped"
        )
