"""Phase of quadrature signals, unwrapped over any number of chunks."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import FloatArray as Array

_TURN = 2.0 * np.pi


def quadrature_phase(cosine: Array, sine: Array) -> Array:
    """Phase (rad) within one turn, (-pi, pi]."""
    return np.arctan2(sine, cosine)


def unwrap(phase: Array, last: float | None = None) -> tuple[Array, float | None]:
    """Unwrap a chunk, continuing after the last unwrapped phase.

    Parameters
    ----------
    phase : ndarray
        ``(n,)``, rad, within one turn.
    last : float, optional
        Last unwrapped phase of the chunk before (rad).

    Returns
    -------
    unwrapped : ndarray
        ``(n,)``; right as long as the motion stays below half a fringe a sample.
    last : float or None
        To be handed to the next call.

    Examples
    --------
    >>> unwrap(np.array([3.0, -3.0]), 3.1)[0].round(3)
    array([3.   , 3.283])
    """
    if phase.size == 0:
        return phase, last
    before = phase[0] if last is None else last
    steps = np.diff(phase, prepend=before)
    turns = np.cumsum(np.rint(steps / _TURN))
    # whole turns are subtracted once, so that no rounding gathers over long records
    unwrapped = phase - _TURN * turns
    return np.asarray(unwrapped), float(unwrapped[-1])
