"""Turning points: the only samples a rate-independent operator can see."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.hysteresis.checks import finite_record


def turning_points(x: ArrayLike) -> NDArray[np.intp]:
    """Return the indices of the first sample, of every reversal and of the last sample.

    On a plateau the first sample of the plateau counts.

    Parameters
    ----------
    x : array
        Record, shape (N,), N >= 1, any unit.

    Returns
    -------
    array of int
        Strictly increasing indices, shape (n_turns,), n_turns >= 1.

    Raises
    ------
    BadInput
        If the record is empty, not one-dimensional or not finite.

    Examples
    --------
    >>> turning_points([0.0, 1.0, 2.0, 2.0, 1.0, 3.0]).tolist()
    [0, 2, 4, 5]
    """
    record = finite_record(x)
    steps = np.sign(np.diff(record))
    moves = np.flatnonzero(steps)
    # A reversal sits where the move before it ended: on a plateau, at its first sample.
    reversals = moves[:-1][steps[moves[1:]] != steps[moves[:-1]]] + 1
    return np.unique(np.concatenate(([0], reversals, [record.size - 1]))).astype(np.intp)
