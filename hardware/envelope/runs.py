"""Runs of true values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


def longest(mask: Mask) -> tuple[int, int]:
    """Return start and length of the (first) longest run; ``(0, 0)`` without any.

    Examples
    --------
    >>> longest(np.array([True, False, True, True]))
    (2, 2)
    """
    if not mask.any():
        return 0, 0
    edges = np.diff(mask.astype(np.int8), prepend=0, append=0)
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    k = int(np.argmax(ends - starts))
    return int(starts[k]), int(ends[k] - starts[k])


def lead(mask: Mask) -> int:
    """Return the length of the run at the start."""
    return mask.size if mask.all() else int(np.argmin(mask))


def trail(mask: Mask) -> int:
    """Return the length of the run at the end."""
    return lead(mask[::-1])
