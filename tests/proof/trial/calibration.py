"""Whether the stated probability is the frequency of being right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from tests.proof.trial.rates import Rate, rate

LEAST = 1e-3
"""A probability of 0 or 1 counts as one that is so far off: the logarithm stays finite."""


@dataclass(frozen=True, slots=True)
class Reliability:
    """Answers whose probability lies in one range, and the mean of what was stated."""

    low: float
    high: float
    stated: float
    right: Rate


def reliability(
    points: Sequence[tuple[float, bool]], edges: Sequence[float]
) -> tuple[Reliability, ...]:
    """Return what was stated beside how often it was right, between every two edges."""
    table = []
    for low, high in pairwise(edges):
        inside = [(c, ok) for c, ok in points if low <= c < high or (high == 1.0 and c >= 1.0)]
        if inside:
            stated = sum(c for c, _ in inside) / len(inside)
            table.append(Reliability(low, high, stated, rate(ok for _, ok in inside)))
    return tuple(table)


def log_score(points: Sequence[tuple[float, bool]]) -> float:
    """Return the mean logarithm of the probability that was given to what came; nan without any.

    Examples
    --------
    >>> round(log_score([(0.5, True), (0.5, False)]), 4)
    -0.6931
    """
    if not points:
        return math.nan
    given = [p if ok else 1.0 - p for p, ok in points]
    return sum(math.log(min(max(g, LEAST), 1.0 - LEAST)) for g in given) / len(given)


def plain_log_score(points: Sequence[tuple[float, bool]]) -> float:
    """Return the log score of who states the same for all: the share that was right."""
    share = sum(ok for _, ok in points) / len(points) if points else math.nan
    return log_score([(share, ok) for _, ok in points])
