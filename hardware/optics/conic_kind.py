"""The curve of second degree that samples in a plane lie on, told without its equation's scale."""

from __future__ import annotations

from enum import Enum
from typing import Final

import numpy as np

from bondgraph.support.arrays import FloatArray as Array

FLAT: Final = 1e-6
"""Least ``4 k1 k2 / (k1 + k2)^2`` of an ellipse, k1 and k2 the principal values of its form.

An arc of t radians to either side of its middle, drawn as wide as high, has t^2 / 4; at 1e-6 it
departs from a parabola by t^2 / 12 = 3e-7 of its height, the step of a converter of 21 bits. The
rounding of doubles stays below 1e-8 for offsets of up to ten thousand amplitudes.
"""
_FINE: Final = 1e-9
"""Relative width under which samples fill no further dimension.

Far above the rounding of doubles (times the condition of the columns, some hundreds), far below
the step of a converter of 24 bits."""
_COARSE: Final = 1e-3
"""Rounding relative to the movement with which no shape is left."""
_DIGITS: Final = 64.0 * float(np.finfo(np.float64).eps)


class ConicKind(Enum):
    """What samples lie on."""

    STILL = "the signals do not move"
    LINE = "the samples lie on a line"
    FEW = "the samples lie on fewer than five distinct points, or all but one on a line"
    PARABOLA = "the samples lie on a parabola or on parallel lines"
    HYPERBOLA = "the samples lie on a hyperbola or on two crossing lines"
    ELLIPSE = "the samples lie on an ellipse"
    SCATTERED = "the samples lie on no curve of second degree"


def form_kind(a: float, b: float, c: float) -> ConicKind:
    """Return the kind of ``a x^2 + b y^2 + c x y + ... = 0``.

    Parameters
    ----------
    a, b, c : float
        Coefficients for samples drawn about as wide as high; their common factor is free.
    """
    flat = FLAT * (a + b) ** 2
    if 4.0 * a * b - c * c > flat:
        return ConicKind.ELLIPSE
    # the trace of a rectangular hyperbola is zero; the norm is not
    if 4.0 * a * b - c * c < -FLAT * (a * a + b * b + 0.5 * c * c):
        return ConicKind.HYPERBOLA
    return ConicKind.PARABOLA


def sample_kind(x: Array, y: Array) -> ConicKind:
    """Return the kind of the curve that samples lie on but for rounding.

    Parameters
    ----------
    x, y : array
        ``(n,)`` in one unit, finite.

    Returns
    -------
    ConicKind
        The same for every affine image of the samples and for changes of their last digits.
    """
    values = np.stack([x, y])
    move = 0.5 * np.ptp(values, axis=1)
    digits = _DIGITS * np.abs(values).max(axis=1)
    moves = (_COARSE * move > digits) & (move > _FINE * move.max())
    if not moves.any():
        return ConicKind.STILL
    if not moves.all():
        return ConicKind.LINE
    slack = max(_FINE, float((digits / move).max()))
    centred = (values - values.mean(axis=1, keepdims=True)) / move[:, None]
    _, widths, axes = np.linalg.svd(np.linalg.qr(centred.T, mode="r"))
    if widths[1] <= slack * widths[0]:
        return ConicKind.LINE
    # principal axes of unit spread: the kind is affine, the conditioning is not
    u, v = np.sqrt(x.size) * (axes @ centred) / widths[:, None]
    columns = np.stack([u * u, v * v, u * v, u, v, np.ones(x.size)], axis=1)
    _, filled, conics = np.linalg.svd(np.linalg.qr(columns, mode="r"))
    slack = min(slack * float(widths[0] / widths[1]), _COARSE)
    free = int(np.count_nonzero(filled <= slack * filled[0]))
    if free > 1:
        return ConicKind.FEW
    return form_kind(*map(float, conics[-1, :3])) if free else ConicKind.SCATTERED
