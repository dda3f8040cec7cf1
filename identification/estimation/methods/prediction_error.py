"""Prediction errors: what a Kalman filter leaves of each reading, with process noise.

The filter and its likelihood are in `identification.estimation.prediction`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, final

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.estimation.methods.method import FitTask, Method, MethodSolution
from identification.estimation.prediction.fit import FilterFit, fit_filter
from identification.estimation.prediction.kalman import KalmanFilter, kalman_filter
from identification.estimation.prediction.likelihood import scored
from identification.estimation.prediction.words import remarks
from identification.study.free_parameters import dead_times, refuse_clocks
from identification.study.joint import JointPoint
from identification.study.study import Study

FINEST = 32
MOVED = 0.3
"""Standard errors by which twice as many sub-steps may move an unknown."""
AWAY = 3.0
"""A free run this many spreads off its record says nothing: one-step predictions are shown."""


@final
class PredictionError(Method):
    """Maximum likelihood of what a Kalman filter predicts one step ahead.

    Memory follows the filtered argument; its own uncertainty is left out.
    """

    name: ClassVar[str] = "prediction_error"
    hears_noise: ClassVar[bool] = True

    def check(self, study: Study) -> None:
        """Refuse dead times, clocks, windows, and laws that the step cannot follow."""
        if late := sorted(dead_times(study.graph)):
            raise UnusableInput(
                f"prediction_error: {', '.join(late)} is a dead time, which is no state of a "
                "filter; use method='single_shooting'"
            )
        refuse_clocks(study.graph, self.name)
        if study.nuisances.clock:
            raise UnusableInput(
                "prediction_error: clock ratios cannot be fitted; resample the recording first or "
                "use method='single_shooting'"
            )
        if study.window is not None:
            raise UnusableInput(
                "prediction_error: the filter runs over whole recordings; leave out window, or use "
                "method='single_shooting'"
            )
        for p in kalman_filter(study).problems:
            p.dynamics.prepare(p.start_vector, p.data.dt, 1, [], False)

    def solve(self, task: FitTask) -> MethodSolution:
        """Climb from `start`."""
        kalman = kalman_filter(task.study, task.setting, task.stack)
        trace: list[float] = []

        def heard(iteration: int, value: float) -> None:
            trace.append(_cost(kalman, value))
            if task.options.report is not None:
                task.options.report(iteration, trace[-1])

        found = fit_filter(
            kalman, start=kalman.start(task.start), max_iterations=task.options.max_iterations,
            progress=heard,
        )  # fmt: skip
        found = _refined(found)
        end = _cost(kalman, found.at.log_likelihood)
        readings, shown, run = _shown(found)
        white = np.concatenate(
            [
                own[p.data.mask("train")].ravel()
                for own, p in zip(found.filtered.innovation, kalman.problems, strict=True)
            ]
        )
        return MethodSolution(
            _point(found, task.start), found.status, (*(trace or [end]), end), _covariance(found),
            (*_levels(found), *remarks(found), *_left_out(task.study), *shown), readings,
            cost=float(np.nanmean(white**2)), filtered=found.filtered, run=run,
        )  # fmt: skip


def _refined(found: FilterFit) -> FilterFit:
    """Double the sub-steps of smooth laws until that moves no unknown by much."""
    kalman = found.kalman
    while kalman.study.n_sub is None and kalman.coarse and kalman.n_sub < FINEST:
        kalman = replace(kalman, n_sub=2 * kalman.n_sub)
        again = fit_filter(kalman, start=found.theta, max_iterations=10)
        error = np.sqrt(np.maximum(np.diag(again.covariance), 0.0))
        known = error > 0
        moved = np.abs(again.theta - found.theta)[known] / error[known]
        found = again
        if moved.max(initial=0.0) < MOVED:
            break
    return found


def _cost(kalman: KalmanFilter, log_likelihood: float) -> float:
    """Geometric mean of the innovations' variances, over the variances of the readings."""
    masks = [scored(kalman, r) for r in range(len(kalman.problems))]
    count = max(sum(float(m.sum()) for m in masks), 1.0)
    scaled = log_likelihood + sum(
        float((m * np.log(kalman.reading_scale(r))).sum()) for r, m in enumerate(masks)
    )
    return float(np.exp(min(-2.0 * scaled / count - np.log(2.0 * np.pi) - 1.0, 700.0)))


def _point(fit: FilterFit, start: JointPoint) -> JointPoint:
    """Unknowns of the joint problem, a state for each window."""
    states = (
        np.tile(fit.kalman.initial(fit.theta, r), (s.shape[0], 1))
        for r, s in enumerate(start.states)
    )
    return JointPoint(fit.theta[fit.kalman.slots.joint].copy(), tuple(states))


def _covariance(fit: FilterFit) -> Array:
    """Covariance of the joint unknowns, widened where the robust one is wider."""
    at, expected = fit.kalman.slots.joint, np.diag(fit.covariance)
    ratio = np.maximum(np.diag(fit.sandwich), expected) / np.where(expected > 0, expected, 1.0)
    wider = np.sqrt(ratio)
    return np.asarray((fit.covariance * np.outer(wider, wider))[at, at])


def _shown(fit: FilterFit) -> tuple[tuple[Array, ...], tuple[str, ...], str]:
    """Return the free runs, one-step predictions where a free run leaves its record, and words."""
    found, left = [], []
    for r, (p, predicted) in enumerate(zip(fit.kalman.problems, fit.filtered.reading, strict=True)):
        with np.errstate(over="ignore", invalid="ignore"):
            simulated = fit.simulated(r)
            off = np.sqrt(np.mean((simulated - p.data.readings) ** 2, axis=0))
        near = bool((off < AWAY * p.data.readings.std(axis=0)).all())
        found.append(simulated if near else predicted)
        if not near:
            left.append(p.data.name)
    if not left:
        return tuple(found), (), ""
    run = f"one-step predictions of {', '.join(left)}, each from the readings before it"
    run += "" if len(left) == len(found) else "; elsewhere a free run"
    words = f"the free run leaves {', '.join(left)}: its readings shown are one-step predictions"
    return tuple(found), (words,), run


def _levels(fit: FilterFit) -> tuple[str, ...]:
    """Process noise and noise of the readings with their intervals."""
    return tuple(
        f"{e.name} = {e.value:.4g} {e.unit} [{e.ci95[0]:.4g}, {e.ci95[1]:.4g}]"
        for e in fit.filtered.noises
    )


def _left_out(study: Study) -> tuple[str, ...]:
    found = []
    if study.nuisances.lags:
        found.append("lags of the sensors are not fitted by prediction errors: taken as zero")
    if study.noise == "coloured":
        found.append("readings' noise is taken as white; process noise colours the innovations")
    return tuple(found)
