"""Readings that begin anew after a turn, as those of an encoder do."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import FloatArray

WHOLE = 0.8
"""Part of a reading's range that a jump of a wrapping reading has at least."""
ALIKE = 0.1
"""Relative difference of such jumps."""
FEWEST = 2
BESIDE = 5
"""Samples beside a jump that tell which way the reading goes."""


def wrap_period(values: FloatArray) -> float | None:
    """Return by how much a reading jumps whenever it has passed a turn; None if it does not.

    The jumps are about as large as all it ever reads, alike, and it goes on after each as it went
    before, against the jump: a signal that switches between levels does not.

    Parameters
    ----------
    values : ndarray, shape (N,)

    Examples
    --------
    >>> import numpy as np
    >>> angle = np.linspace(0.0, 20.0, 500)
    >>> round(wrap_period(np.mod(angle, 6.0)), 1)
    6.0
    >>> wrap_period(np.sin(angle)) is None
    True
    """
    span = float(np.ptp(values)) if values.size else 0.0
    if not span > 0 or not np.isfinite(span):
        return None
    change = np.diff(values)
    at = np.flatnonzero(np.abs(change) > WHOLE * span)
    if at.size < FEWEST:
        return None
    inside = [k for k in at if k >= BESIDE and k + BESIDE + 1 < values.size]
    going = [
        (values[k] - values[k - BESIDE], values[k + 1 + BESIDE] - values[k + 1]) for k in inside
    ]
    against = [
        before * after > 0 and before * change[k] < 0 and max(abs(before), abs(after)) < span / 2
        for k, (before, after) in zip(inside, going, strict=True)
    ]
    if not against or np.mean(against) < 1.0 - ALIKE:
        return None
    step = [(abs(b) + abs(a)) / (2 * BESIDE) for b, a in going]
    sizes = [abs(change[k]) + s for k, s in zip(inside, step, strict=True)]
    period = float(np.median(sizes))
    return period if np.ptp(sizes) < ALIKE * period else None


def unwrapped(values: FloatArray, period: float) -> FloatArray:
    """Return a reading without its jumps by whole turns, shape (N,).

    Parameters
    ----------
    values : ndarray, shape (N,)
    period : float
        One turn, in the unit of the values.

    Examples
    --------
    >>> import numpy as np
    >>> unwrapped(np.array([5.0, 5.9, 0.8, 1.7]), 6.0)
    array([5. , 5.9, 6.8, 7.7])
    """
    return np.asarray(np.unwrap(values, period=period), np.float64)
