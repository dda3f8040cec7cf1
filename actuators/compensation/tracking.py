"""Numbers for how well a displacement follows its reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuators.stack.loop_width import branch_at
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

LEVELS = 400
"""Of the reference at which the branches of a loop are compared, less one."""


@dataclass(frozen=True, slots=True)
class Tracking:
    """Errors of a displacement against its reference.

    Attributes
    ----------
    rms, largest : float
        m.
    relative : float
        rms over the range of the reference.
    thickness : float
        Of the loop of displacement over reference, m; 0 without hysteresis and lag.
    """

    rms: float
    largest: float
    relative: float
    thickness: float


def tracking(reference: FloatArray, achieved: FloatArray) -> Tracking:
    """Compare a displacement with its reference.

    Parameters
    ----------
    reference, achieved : ndarray, shape (N,), m

    Raises
    ------
    UnusableInput
        If the shapes differ, a value is not finite or the reference is constant.

    Examples
    --------
    >>> tracking(np.array([0.0, 2.0, 0.0]), np.array([0.0, 2.0, 1.0])).largest
    1.0
    """
    if reference.shape != achieved.shape or reference.ndim != 1 or reference.size < 2:
        raise UnusableInput(
            f"tracking: reference {reference.shape} and displacement {achieved.shape} must be "
            "records of one length"
        )
    span = float(np.ptp(reference))
    if not (np.isfinite(achieved).all() and np.isfinite(span)) or span == 0.0:
        raise UnusableInput("tracking: the records must be finite and the reference must move")
    error = reference - achieved
    rms = float(np.sqrt(np.mean(error**2)))
    return Tracking(
        rms, float(np.abs(error).max()), rms / span, loop_thickness(reference, achieved)
    )


def loop_thickness(reference: FloatArray, achieved: FloatArray) -> float:
    """Return the largest gap between the longest rise and fall that adjoin, m.

    Parameters
    ----------
    reference, achieved : ndarray, shape (N,), m

    Returns
    -------
    float
        0 if the reference has no two opposite branches.

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 2.0, 1.0, 0.0])
    >>> loop_thickness(x, np.array([0.0, 1.0, 2.0, 1.5, 0.0]))
    0.5
    """
    direction = np.sign(np.diff(reference))
    moving = np.flatnonzero(direction)
    if not moving.size:
        return 0.0
    turns = np.flatnonzero(np.diff(direction[moving]))
    if not turns.size:
        return 0.0
    starts = np.concatenate([[0], moving[turns] + 1, [reference.size - 1]])
    lengths = np.abs(np.diff(reference[starts]))
    pair = max(range(lengths.size - 1), key=lambda i: (min(lengths[i], lengths[i + 1]), i))
    first = slice(starts[pair], starts[pair + 1] + 1)
    second = slice(starts[pair + 1], starts[pair + 2] + 1)
    low = max(reference[first].min(), reference[second].min())
    high = min(reference[first].max(), reference[second].max())
    levels = np.linspace(low, high, LEVELS + 1)
    one, other = (branch_at(levels, reference[part], achieved[part]) for part in (first, second))
    return float(np.abs(one - other).max())
