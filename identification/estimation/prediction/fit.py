"""The fit of a Kalman filter: where it ends, how sure that is, and what the filter sees there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.estimates import Estimate
from identification.estimation.filtered import Filtered
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.prediction.kalman import KalmanFilter
from identification.estimation.prediction.likelihood import LikelihoodEvaluation, pass_over
from identification.estimation.prediction.scoring import ClimbPoint, maximise
from identification.estimation.threads import single_threaded
from identification.study.residual import Point, evaluate

QUIET = 0.05
"""Noise of a sensor where a fit begins without process noise, in spreads of the reading."""


@dataclass(frozen=True, eq=False)
class FilterFit:
    """Where the likelihood of a filter is largest.

    Attributes
    ----------
    theta : ndarray, shape (n_theta,)
    at : LikelihoodEvaluation
    covariance : ndarray, shape (n_theta, n_theta)
        Inverse of the expected information (with priors), in theta; zero for what stands at a
        bound.
    sandwich : ndarray, shape (n_theta, n_theta)
        Holds for a wrong noise model too; from the scores of blocks of samples.
    """

    kalman: KalmanFilter
    theta: Array
    at: LikelihoodEvaluation
    status: FitStatus
    covariance: Array
    sandwich: Array

    @property
    def sigma(self) -> dict[str, float]:
        """Diffusions by place, SI; zero where the data ask for none."""
        at, (lower, _) = self.kalman.slots.sigma, self.kalman.bounds
        values = np.where(self.theta[at] <= lower[at] + 1e-9, 0.0, np.exp(self.theta[at]))
        return dict(zip(self.kalman.sigma, map(float, values), strict=True))

    @cached_property
    def filtered(self) -> Filtered:
        """Every record, held-out samples included, through the filter."""
        parts: list[tuple[Array, Array, Array, Array]] = []
        for r, p in enumerate(self.kalman.problems):
            y, x = self.kalman.reading_scale(r), self.kalman.state_scale[r]
            mask = np.isfinite(p.data.readings).astype(float)
            passed, _ = pass_over(self.kalman, self.theta, r, mask)
            with np.errstate(invalid="ignore"):
                deviation = np.sqrt(passed.variance)
                own = np.where(mask > 0, passed.innovation / deviation, np.nan)
            parts.append((passed.reading * y, own, passed.state * x, deviation * y))
        return Filtered(self.at.log_likelihood, self.noises(), *zip(*parts, strict=True))

    def simulated(self, record: int) -> Array:
        """Return the readings of a free run from the fitted initial state, SI, shape (N, n_y)."""
        kalman, problem = self.kalman, self.kalman.problems[record]
        problem = replace(problem, n_sub=kalman.n_sub, correction=None, built=problem.dynamics)
        begin = kalman.initial(self.theta, record)[None]
        return evaluate(
            problem, Point(kalman.local(self.theta, record), begin), derivatives=False
        ).y

    def noises(self) -> tuple[Estimate, ...]:
        """Diffusions and noise of the readings; intervals are the wider of both covariances'."""
        at, (lower, upper), theta = self.kalman.slots, self.kalman.bounds, self.theta
        variance = np.maximum(np.diag(self.covariance), np.diag(self.sandwich))
        reach = np.minimum(1.96 * np.sqrt(variance), 50.0)
        graph = self.kalman.study.graph
        named = [(f"sigma {d.place}", d.unit) for d in self.kalman.diffusions() if d is not None]
        for n in self.kalman.estimated:
            named.append((f"noise {n}", str(getattr(graph[n], "unit", "") or "1")))
        found = []
        for i, (name, unit) in enumerate(named, start=at.sigma.start):
            if i < at.sigma.stop and theta[i] <= lower[i] + 1e-9:
                found.append(Estimate(name, 0.0, unit, (0.0, _largest(self.at, theta, i)), True))
                continue
            low, value, high = map(float, np.exp(theta[i] + reach[i] * np.array([-1.0, 0.0, 1.0])))
            stuck = bool(theta[i] <= lower[i] + 1e-9 or theta[i] >= upper[i] - 1e-9)
            found.append(Estimate(name, value, unit, (low, high), stuck))
        return tuple(found)


@single_threaded
def fit_filter(
    kalman: KalmanFilter,
    *,
    start: Array | None = None,
    max_iterations: int = 60,
    progress: Callable[[int, float], None] | None = None,
) -> FilterFit:
    """Fit by the likelihood of the prediction errors.

    Parameters
    ----------
    start : ndarray, shape (n_theta,), optional
        Where to begin; the start values of the study otherwise.
    progress : callable, optional
        Called with the iteration and the log-likelihood.
    """
    begin = kalman.start() if start is None else np.asarray(start, float)
    found, status = maximise(kalman, begin, max_iterations=max_iterations, progress=progress)
    at, (lower, _) = kalman.slots.noise, kalman.bounds
    if (found.theta[at] <= lower[at] + 1e-6).any():
        # process noise can imitate the noise of a sensor; begin from the other end as well
        other, how = maximise(kalman, _quiet(kalman, begin), max_iterations=max_iterations)
        if other.now.log_likelihood > found.now.log_likelihood:
            found, status = other, how
    return FilterFit(kalman, found.theta, found.now, status, *_covariances(kalman, found))


def _quiet(kalman: KalmanFilter, begin: Array) -> Array:
    """Return a start with hardly any process noise, all misfit being noise of the sensors."""
    at, theta = kalman.slots, begin.copy()
    lower, upper = kalman.bounds
    theta[at.sigma] = lower[at.sigma] + 1.0
    theta[at.noise] = np.log([QUIET * kalman.reading_spread[n] for n in kalman.estimated])
    return np.asarray(np.clip(theta, lower, upper))


def _covariances(kalman: KalmanFilter, found: ClimbPoint) -> tuple[Array, Array]:
    lower, upper = kalman.bounds
    inside = (found.theta > lower + 1e-9) & (found.theta < upper - 1e-9)
    information = found.information
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    inside &= size > 1e-9
    pick = np.ix_(inside, inside)
    unit = 1.0 / size[inside]
    scaled = information[pick] * np.outer(unit, unit)
    inverse = np.linalg.pinv(scaled, hermitian=True, rcond=1e-13) * np.outer(unit, unit)
    expected, robust = np.zeros_like(information), np.zeros_like(information)
    expected[pick] = inverse
    g = found.now.scores[:, inside]
    g = g - g.mean(axis=0) if g.shape[0] else g
    robust[pick] = inverse @ (g.T @ g) @ inverse
    return expected, robust


def _largest(now: LikelihoodEvaluation, theta: Array, i: int) -> float:
    """Diffusion that would lower the log-likelihood from that of none by 1.92 (95 %).

    From slope and curvature by the variance, which unlike its logarithm reaches zero.
    """
    variance = float(np.exp(2.0 * theta[i]))
    slope = min(float(now.gradient[i]) / (2.0 * variance), 0.0)
    curvature = float(now.information[i, i]) / (2.0 * variance) ** 2
    if not curvature > 0.0:
        return float("inf")
    return float(np.sqrt((slope + np.sqrt(slope**2 + 3.84 * curvature)) / curvature))
