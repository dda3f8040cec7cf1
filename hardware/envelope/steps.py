"""The small steps in which an output goes from one voltage to another."""

from __future__ import annotations

import math
from collections.abc import Iterator


def in_steps(
    start: float, target: float, rate: float, largest: float, tick: float, period: float
) -> tuple[float, Iterator[float]]:
    """Return the time before every write (s) and the voltages to write (V), the target at last.

    Parameters
    ----------
    start, target : float
        V; where they are the same the target is written once.
    rate : float
        V/s.
    largest : float
        Largest step (V).
    tick : float
        Longest time between two writes (s), if `period` is not longer.
    period : float
        Shortest time between two writes (s).

    Examples
    --------
    >>> pause, volts = in_steps(0.0, 1.0, 10.0, 0.5, 0.1, 1e-3)
    >>> pause, list(volts)
    (0.05, [0.5, 1.0])
    """
    span = target - start
    count = max(math.ceil(abs(span) / min(rate * max(tick, period), largest)), 1)
    volts = (start + span * (k / count) if k < count else target for k in range(1, count + 1))
    return max(abs(span) / count / rate, period), volts
