"""How steps are halved where they and their halves differ, in both engines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bondgraph.simulation.exact_run import KernelRun
from bondgraph.support.arrays import Array

DEPTH = 20
"""How often a step is halved, as in ``march.c`` and ``radau/loop.c``."""
MOST = 512
"""Steps a sample that a run may take on the average, those that are compared among them."""
FIRST, FINER, TRIES = 0.1, 0.1, 5
"""Difference of a step and its halves over the accuracy asked for, at first, and then again."""


@dataclass(frozen=True, eq=False)
class Within:
    """What a step and its halves may differ by, and what became of a run.

    Attributes
    ----------
    allowed : ndarray, shape (n,)
        Of each number that a run carries; 0 where it may be anything.
    left : ndarray of int, shape (1,)
        Steps that may still be taken.
    ends : ndarray, shape (2, n)
        Least and largest of each number at the ends of sub-steps.
    """

    allowed: Array
    left: Array
    ends: Array

    @property
    def arrays(self) -> tuple[Array, Array, Array]:
        """As compiled code takes them."""
        return self.allowed, self.left, self.ends


Run = TypeVar("Run", bound=KernelRun)


def halved(
    run_with: Callable[[Within], Run],
    change: Callable[[Run, Run], float],
    start: Array,
    counted: Array,
    samples: int,
    accuracy: float,
    most: int = MOST,
) -> tuple[int, Run] | None:
    """Run in ever finer steps until the outputs settle; returns steps a sample and the last run.

    None where they do not, or where steps run out.

    Parameters
    ----------
    run_with : callable
        Runs within what it is given, which it fills.
    change : callable
        Of the outputs of two runs, over their range.
    start : ndarray, shape (n,)
        Numbers that a run carries, at the start.
    counted : ndarray of bool, shape (n,)
        Which of them have to agree.
    samples : int
    accuracy : float
    most : int
        Steps a sample that a run may take on the average.
    """

    def within(allowed: Array) -> Within:
        return Within(allowed, np.array([most * samples]), np.stack([start, start]))

    seen = within(np.zeros(start.size))
    run_with(seen)  # how far each number goes
    tolerance, last = FIRST * accuracy, None
    for _ in range(TRIES):
        low, high = seen.ends
        rounding = 1e-14 * np.maximum(np.abs(low), np.abs(high))
        seen = within(counted * (tolerance * (high - low) + rounding))
        run = run_with(seen)
        if seen.left[0] <= 0 or not (run.settled and np.isfinite(run.y).all()):
            return None
        if last is not None and change(last, run) < accuracy:
            return -(-(most * samples - int(seen.left[0])) // samples), run
        last, tolerance = run, FINER * tolerance
    return None
