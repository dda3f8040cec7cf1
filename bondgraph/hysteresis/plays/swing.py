"""Sums of plays, or of stops, by their turning points: the cost a sample does not grow with n.

Between two reversals such a sum follows one fixed curve of the swing since the last turning point
that still counts (Masing's rule; a larger swing wipes out the smaller ones). The curve is piecewise
linear with corners at 2 r_i. Any stored memory is first written as the turning points that would
have left it, so the method is exact from every state.

Sizes: N samples, n plays.
"""

from __future__ import annotations

import numpy as np

from bondgraph.hysteresis.plays.kernels import kernels_available, swings
from bondgraph.support.ops import FloatArray

SWING_FROM = 2000
"""Writing a memory as turning points costs about as much as the plays over this many samples."""


def swing_record(
    x: FloatArray, r: FloatArray, slopes: FloatArray, y: FloatArray, before: float, output: float
) -> tuple[FloatArray, FloatArray]:
    """Return the output of a sum of plays or stops over a record, and the states after it.

    Parameters
    ----------
    x : array
        Finite input, shape (N,), N >= 1, any unit.
    r : array
        Half widths, strictly increasing, positive, shape (n,), n >= 1, unit of ``x``.
    slopes : array
        Slope of the output along a branch between the corners, shape (n + 1,); for plays the
        partial sums of the weights.
    y : array
        Admissible states before the first sample, shape (n,), unit of ``x``.
    before : float
        An input at which the states can rest, unit of ``x``.
    output : float
        Output there.

    Returns
    -------
    array
        Output, shape (N,).
    array
        States after the last sample, shape (n,); to the last bit those of the clamps.

    References
    ----------
    krejci2001
    """
    knots = np.concatenate(([0.0], 2.0 * r))
    values = np.concatenate(([0.0], np.cumsum(np.diff(knots) * slopes[:-1])))
    extremes, direction = extremes_of(r, y, before)
    swing = np.abs(np.diff(extremes))
    at = np.searchsorted(knots, swing, side="right") - 1
    change = values[at] + slopes[at] * (swing - knots[at])
    signs = direction * (-1.0) ** np.arange(1, extremes.size)
    outputs = output - np.concatenate((np.cumsum((signs * change)[::-1])[::-1], [0.0]))
    record, left = swings(x, knots, values, slopes, extremes, outputs, direction)
    for extreme in left:
        y = np.maximum(extreme - r, np.minimum(extreme + r, y))
    return record, y


def worth_swinging(x: FloatArray, r: FloatArray, y: FloatArray) -> bool:
    """Tell whether a record is long enough, the loops are compiled and the states reachable.

    States that no history leaves, such as neighbours further apart than their half widths, are no
    set of turning points; only the clamps themselves carry them on.

    Parameters
    ----------
    x, r, y : array
        Input, half widths and states, shapes (N,), (n,) and (n,).
    """
    if x.size <= SWING_FROM or not kernels_available():
        return False
    size = float(np.abs(y).max()) + float(r[-1])
    fine = float(np.diff(r, prepend=0.0).min()) > 1e-10 * (size + float(np.abs(x).max()))
    if not fine or r[-1] > 1e3 * np.ptp(x):
        return False  # turning points would lose digits that clamps keep
    gaps = np.diff(r)
    rounding = 1e-12 * (np.abs(y[1:]) + np.abs(y[:-1]) + r[1:])
    return bool(np.all(np.abs(np.diff(y)) <= gaps + rounding))


def extremes_of(r: FloatArray, y: FloatArray, before: float) -> tuple[FloatArray, float]:
    """Return turning points that leave given play states, and the direction of the first.

    The states are samples of a memory curve over the half width, whose slope is +1 where the last
    turning point that counts is a minimum and -1 where it is a maximum. Between two half widths
    the curve may bend once; which way round makes no difference to the states.

    Parameters
    ----------
    r : array
        Half widths, strictly increasing, positive, shape (n,), n >= 1, any unit.
    y : array
        Admissible states, shape (n,), unit of ``r``.
    before : float
        Present input, unit of ``r``.

    Returns
    -------
    array
        Turning points, outermost first, then ``before``; unit of ``r``.
    float
        1.0 if the outermost is a maximum, -1.0 if it is a minimum.

    References
    ----------
    krejci2001

    Examples
    --------
    >>> extremes, direction = extremes_of(np.array([1.0, 2.0]), np.array([0.0, -1.0]), 1.0)
    >>> extremes.tolist(), direction
    ([1.0], 1.0)
    """
    gaps = np.diff(r, prepend=0.0)
    rises = np.diff(y, prepend=before)
    found: list[float] = []
    sign = 0.0
    width, level = 0.0, before
    for gap, rise, r_i, y_i in zip(gaps, rises, r, y, strict=True):
        up, down = 0.5 * (gap + rise), 0.5 * (gap - rise)
        tiny = 4e-16 * (abs(r_i) + abs(y_i))
        pieces = [(1.0, up), (-1.0, down)] if sign >= 0.0 else [(-1.0, down), (1.0, up)]
        for way, length in pieces:
            if length > tiny:
                if way != sign:
                    found.append(level - way * width)
                    sign = way
                width, level = width + length, level + way * length
        width, level = float(r_i), float(y_i)
    return np.array(found[::-1]), -sign
