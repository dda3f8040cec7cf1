"""Fisher scoring: damped steps with the expected information, within bounds, on the posterior."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.descent import Damping, Ended, Trial, bounded_step, descend
from identification.estimation.levenberg_marquardt import STATUS, FitStatus
from identification.estimation.prediction.kalman import KalmanFilter
from identification.estimation.prediction.likelihood import LikelihoodEvaluation, evaluate
from identification.study.joint import STATE_WEIGHT

ENOUGH = 1e-5
"""Expected gain of the log-likelihood below which a step is not worth taking."""

LARGEST_STEP = 2.0
"""Largest change of a logarithm in one step."""


@dataclass(frozen=True, slots=True)
class ClimbPoint:
    """A point of the climb.

    Attributes
    ----------
    theta : ndarray, shape (n_theta,)
    now : LikelihoodEvaluation
    cost : float
        Minus the logarithm of the posterior.
    gradient : ndarray, shape (n_theta,)
        Of the logarithm of the posterior.
    information : ndarray, shape (n_theta, n_theta)
        Expected, that of the priors included.
    expected : float
        Gain that was expected of the step to there.
    """

    theta: Array
    now: LikelihoodEvaluation
    cost: float
    gradient: Array
    information: Array
    expected: float = 0.0


def scored_at(kalman: KalmanFilter, theta: Array, expected: float = 0.0) -> ClimbPoint:
    """Evaluate likelihood and priors: those of the joint problem, ten spreads on initial states."""
    at, now = kalman.slots, evaluate(kalman, theta)
    weight, centre = np.zeros(at.size), np.zeros(at.size)
    weight[at.joint], centre[at.joint] = kalman.stack.prior
    weight[at.noise.stop :] = STATE_WEIGHT
    away = weight * (theta - centre)
    return ClimbPoint(
        theta, now, 0.5 * float(away @ away) - now.log_likelihood, now.gradient - weight * away,
        now.information + np.diag(weight**2), expected,
    )  # fmt: skip


def maximise(
    kalman: KalmanFilter,
    start: Array,
    *,
    max_iterations: int = 60,
    progress: Callable[[int, float], None] | None = None,
) -> tuple[ClimbPoint, FitStatus]:
    """Climb from `start`; diffusions that do nothing end at their lower bound.

    Parameters
    ----------
    progress : callable, optional
        Called with the iteration and the log-likelihood.
    """
    lower, upper = kalman.bounds
    begun = scored_at(kalman, np.clip(start, lower, upper))
    if not np.isfinite(begun.now.log_likelihood):
        return begun, FitStatus.BROKEN
    number, zeroed = count(1), False

    def taken(at: ClimbPoint) -> None:
        if progress is not None:
            progress(next(number), at.now.log_likelihood)

    def without(at: ClimbPoint, why: Ended) -> ClimbPoint | None:
        nonlocal zeroed
        if zeroed or why is not Ended.ARRIVED:
            return None
        zeroed = True
        made = _without(kalman, at, lower)
        return None if made is at else made

    def trusted(before: ClimbPoint, at: ClimbPoint) -> bool:
        return before.cost - at.cost > 0.5 * at.expected

    made = descend(
        begun, lambda at: _steps(kalman, at, lower, upper), DAMPING, max_iterations,
        lambda before, at: False, rescue=without, trusted=trusted, taken=taken, kept=True,
    )  # fmt: skip
    return made.at, STATUS[made.ended]


DAMPING = Damping(start=1e-3, less=10.0, more=8.0, least=1e-8, again=1e-3, tries=12, rescued=1e-3)


def _steps(kalman: KalmanFilter, at: ClimbPoint, lower: Array, upper: Array) -> Trial[ClimbPoint]:
    """Return what makes the damped steps from a point."""

    def trial(damping: float, number: int) -> ClimbPoint | Ended | None:
        step, expected = _step(kalman, at, damping, lower, upper)
        if abs(expected) < ENOUGH:
            return Ended.ARRIVED
        # rounding may spoil the step where a free run has run away
        return scored_at(kalman, at.theta + step, expected) if expected > 0 else None

    return trial


def _step(
    kalman: KalmanFilter, at: ClimbPoint, damping: float, lower: Array, upper: Array
) -> tuple[Array, float]:
    """Damped step within bounds and the gain that the quadratic model expects of it."""
    theta, gradient, information = at.theta, at.gradient, at.information
    limit = np.where(_logarithmic(kalman), LARGEST_STEP, np.inf)
    low, high = np.maximum(lower - theta, -limit), np.minimum(upper - theta, limit)
    size = np.sqrt(np.diag(information))
    alive = (size > 1e-9) & (high > low)
    step = np.zeros(theta.size)
    if not alive.any():
        return step, 0.0
    unit = 1.0 / size[alive]
    h = information[np.ix_(alive, alive)] * np.outer(unit, unit)
    h = h + (damping + 1e-12) * np.eye(h.shape[0])
    values, vectors = np.linalg.eigh(h)
    root = np.sqrt(np.maximum(values, 1e-12))
    a = root[:, None] * vectors.T
    b = (vectors.T @ (gradient[alive] * unit)) / root
    step[alive] = bounded_step(a, b, low[alive] * size[alive], high[alive] * size[alive]) * unit
    expected = float(gradient @ step - 0.5 * step @ information @ step)
    return np.clip(step, low, high), expected


def _logarithmic(kalman: KalmanFilter) -> Array:
    at, found = kalman.slots, np.zeros(kalman.slots.size, bool)
    found[at.joint] = np.isfinite(kalman.stack.lowest)
    found[at.sigma] = found[at.noise] = True
    return found


def _without(kalman: KalmanFilter, at: ClimbPoint, lower: Array) -> ClimbPoint:
    """Set diffusions to their lower bound where the likelihood loses nothing by it.

    On a logarithmic scale the way to zero has no end and no slope; one jump finds it.
    """
    sigma = kalman.slots.sigma
    for i in range(sigma.start, sigma.stop):
        if at.theta[i] <= lower[i] or at.now.information[i, i] > 4.0:
            continue
        trial = at.theta.copy()
        trial[i] = lower[i]
        made = scored_at(kalman, trial)
        if made.cost <= at.cost + 1e-2:
            at = made
    return at
