"""Damped descent: a step is shortened until it lowers the misfit (Levenberg 1944, Marquardt 1963).

What a step is, Gauss-Newton's or Fisher's, and within which bounds, is the business of who
descends; how it is damped, when it is taken and when there is nothing more to gain is said here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Generic, Protocol, TypeVar

import numpy as np

from bondgraph.support.arrays import Array


class LoweredPoint(Protocol):
    """Where a descent stands."""

    @property
    def cost(self) -> float:
        """What is lowered; not finite where the model cannot be computed."""
        ...


class Ended(Enum):
    """Why a descent ended."""

    ARRIVED = "arrived"
    STUCK = "no step lowers the misfit"
    LIMIT = "the largest number of steps"
    CANCELLED = "Ctrl-C"


S = TypeVar("S", bound=LoweredPoint)
Trial = Callable[[float, int], S | Ended | None]
"""Makes the step of a damping; told how many were tried from there before. None where it cannot be
computed, `Ended.ARRIVED` where no step could gain more than rounding."""


@dataclass(frozen=True, slots=True)
class Damping:
    """How the damping moves.

    Attributes
    ----------
    start : float
    less, more : float
        What it is divided by after a step that was taken, and multiplied by before one is tried
        again.
    least, most : float
        The last one that is tried is `most`.
    again : float
        Least damping of a step that is tried again.
    tries : int
        Steps that are tried from one point at the most.
    rescued : float
        Damping behind a rescue.
    """

    start: float = 1e-3
    less: float = 6.0
    more: float = 8.0
    least: float = 1e-9
    most: float = 1e9
    again: float = 0.0
    tries: int = 100
    rescued: float = 1e-2


@dataclass(frozen=True, slots=True)
class Descended(Generic[S]):
    """The lowest point of a descent.

    Attributes
    ----------
    at : standing
    steps : int
        That were taken.
    """

    at: S
    ended: Ended
    steps: int


def descend(
    start: S,
    steps_from: Callable[[S], Trial[S]],
    damping: Damping,
    most: int,
    arrived: Callable[[S, S], bool],
    *,
    rescue: Callable[[S, Ended], S | None] = lambda at, why: None,
    trusted: Callable[[S, S], bool] = lambda before, at: True,
    taken: Callable[[S], None] = lambda at: None,
    kept: bool = False,
) -> Descended[S]:
    """Descend from `start`.

    Parameters
    ----------
    steps_from : callable
        Linearises at a point; returns what makes the step of a damping.
    most : int
        Largest number of steps.
    arrived : callable
        Of a point and the next one: whether that step was the last.
    rescue : callable
        Another point from one where the descent would end, told why; None ends it.
    trusted : callable
        Of a point and the next one: whether the step did what was expected of it. Only then the
        damping falls.
    taken : callable
        Told every further point.
    kept : bool
        A KeyboardInterrupt ends it at the lowest point so far.
    """
    at, strength, count = start, damping.start, 0
    try:
        for count in range(most):
            found, strength = _lowered(steps_from(at), at.cost, strength, damping)
            if isinstance(found, Ended):
                other = rescue(at, found)
                if other is None:
                    return Descended(at, found, count)
                at, strength = other, damping.rescued
                taken(at)
                continue
            before, at = at, found
            if trusted(before, at):
                strength = max(strength / damping.less, damping.least)
            taken(at)
            if arrived(before, at):
                return Descended(at, Ended.ARRIVED, count + 1)
    except KeyboardInterrupt:
        if not kept:
            raise
        return Descended(at, Ended.CANCELLED, count)
    return Descended(at, Ended.LIMIT, most)


def _lowered(
    trial: Trial[S], cost: float, strength: float, law: Damping
) -> tuple[S | Ended, float]:
    """Return a step that lowers the cost, with its damping, or why there is none."""
    for number in range(law.tries):
        found = trial(strength, number)
        if isinstance(found, Ended):
            return found, strength
        if found is not None and np.isfinite(found.cost) and found.cost <= cost:
            return found, strength
        if strength >= law.most:
            break
        strength = min(max(strength * law.more, law.again), law.most)
    return Ended.STUCK, strength


def bounded_step(a: Array, b: Array, low: Array, high: Array) -> Array:
    """Return the step that solves ``a x = b`` best within bounds.

    Parameters
    ----------
    a : ndarray, shape (m, n)
    b : ndarray, shape (m,)
    low, high : ndarray, shape (n,)
        Where they are equal the step is zero.
    """
    free = high > low
    step = np.zeros(free.size)
    step[free] = np.linalg.lstsq(a[:, free], b, rcond=None)[0]
    if not ((step < low) | (step > high)).any():
        return step
    from scipy.optimize import lsq_linear  # late: most steps do not need it

    size = np.linalg.norm(a[:, free], axis=0) + 1e-12
    solved = lsq_linear(a[:, free] / size, b, (low[free] * size, high[free] * size), method="bvls")
    step = np.zeros(free.size)
    step[free] = solved.x / size
    return np.asarray(np.clip(step, low, high))
