"""How far a variable has moved since it last turned: the memory a hysteresis would have."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import Array

SWING = 0.02


def turning_points(v: Array, swing: float = SWING) -> Array:
    """Return the samples at which `v` turns, first and last sample included.

    Parameters
    ----------
    v : ndarray, shape (N,)
    swing : float
        Turns smaller than this part of the range are noise.

    Examples
    --------
    >>> turning_points(np.array([0.0, 1.0, 2.0, 1.0, 0.0, 1.0])).tolist()
    [0, 2, 4, 5]
    """
    from scipy.signal import find_peaks

    least = swing * float(np.ptp(v))
    if v.size < 3 or least <= 0:
        return np.arange(min(v.size, 1))
    up, _ = find_peaks(v, prominence=least)
    down, _ = find_peaks(-v, prominence=least)
    return np.unique(np.concatenate([[0], up, down, [v.size - 1]])).astype(int)


def since_turning(v: Array, swing: float = SWING) -> Array:
    """Distance of `v` from its value at the last turning point, shape (N,), unit of `v`.

    A law with memory fails (or matters most) at one end of this axis, a law without memory
    nowhere in particular.
    """
    turns = turning_points(v, swing)
    last = turns[np.searchsorted(turns, np.arange(v.size), side="right") - 1]
    return np.asarray(np.abs(v - v[last]))
