"""Readings that begin anew after a turn, as those of an encoder do."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import FloatArray

WHOLE = 0.8
"""Part of a reading's range that a jump of a wrapping reading has at least."""
ALIKE = 0.1
"""Relative difference of such jumps."""
FEWEST = 2
QUIET = 0.6745 * 6**0.5
"""Median size of the second differences of white noise, over its deviation."""


def wrap_period(values: FloatArray) -> float | None:
    """Return by how much a reading jumps whenever it has passed a turn; None if it does not.

    The jumps are about as large as all it ever reads, alike and at the edges of what it reads, and
    made straight it passes these edges: a signal that switches between levels does not.

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
    if at.size == change.size:
        return None
    step = float(np.quantile(np.abs(np.delete(change, at)), 0.9))
    sizes = np.abs(change[at]) + step
    period = float(np.median(sizes))
    straight = unwrapped(values, period)
    noise = float(np.median(np.abs(np.diff(straight, 2)))) / QUIET
    near = step + 5.0 * noise
    # noise alone makes a reading at the edge jump to and fro: a turn is passed where it is clear of
    # the edge before and after
    turn = (straight - values.max()) / period
    low, high = np.floor(turn - near / period), np.floor(turn + near / period)
    passed = np.count_nonzero(np.diff(low[low == high]))
    edge = np.abs(turn - np.round(turn))[np.r_[at, at + 1]] * period
    clear = passed >= FEWEST and np.mean(edge > near + step) < ALIKE
    return period if clear and np.ptp(sizes) < ALIKE * period + 2 * near else None


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
