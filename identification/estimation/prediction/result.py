"""Fit by prediction errors: values with intervals, what the filter saw, and words about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from threadpoolctl import threadpool_limits

from bondgraph.simulation.exact_run import run_record
from bondgraph.support.arrays import Array
from identification.estimation.estimates import Estimate
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.prediction.likelihood import LikelihoodEvaluation, pass_over
from identification.estimation.prediction.model import PredictionModel
from identification.estimation.prediction.scoring import Maximum, maximise, prior
from identification.estimation.prediction.words import remarks

QUIET = 0.05
"""Noise of a sensor where a fit begins without process noise, in spreads of the reading."""


@dataclass(frozen=True, eq=False, slots=True)
class Predicted:
    """One record seen through the filter at the fitted values, SI.

    Attributes
    ----------
    reading : ndarray, shape (N, n_y)
        Predicted one step ahead.
    innovation : ndarray, shape (N, n_y)
        Over its standard deviation: white with unit variance if the model is right; each reading
        less what the readings before it in the same sample tell; NaN where it is missing.
    state : ndarray, shape (N, n_x)
        Filtered: given the readings up to each sample.
    simulated : ndarray, shape (N, n_y)
        Readings of a free run from the fitted initial state, without process noise.
    """

    reading: Array
    innovation: Array
    state: Array
    simulated: Array


@dataclass(frozen=True, eq=False)
class PredictionFit:
    """Maximum-likelihood fit of a model with process noise.

    Attributes
    ----------
    log_likelihood : float
        Of the training readings, natural logarithm, SI.
    covariance : ndarray, shape (n_theta, n_theta)
        Inverse of the expected information (with priors), in theta; zero for what stands at a
        bound.
    sandwich : ndarray, shape (n_theta, n_theta)
        Holds for a wrong noise model too; from the scores of blocks of samples.
    estimates : tuple of Estimate
        Intervals are the wider of the two covariances'.
    remarks : tuple of str
        What to know before believing the numbers.
    """

    model: PredictionModel
    theta: Array
    status: FitStatus
    iterations: int
    log_likelihood: float
    count: int
    covariance: Array
    sandwich: Array
    estimates: tuple[Estimate, ...]
    remarks: tuple[str, ...]

    @property
    def values(self) -> dict[str, float]:
        """All model parameters by name, SI."""
        names = self.model.compiled.parameter_names
        return dict(zip(names, map(float, self.model.vector(self.theta)), strict=True))

    @property
    def sigma(self) -> dict[str, float]:
        """Diffusions by place, SI; zero where the data ask for none."""
        at, (lower, _) = self.model.slots, self.model.bounds()
        found = {}
        for i, d in enumerate(self.model.diffusions, start=at.sigma.start):
            none = self.theta[i] <= lower[i] + 1e-9
            found[d.place] = 0.0 if none else float(np.exp(self.theta[i]))
        return found

    @property
    def noise(self) -> dict[str, float]:
        """Standard deviation of the noise of each reading, SI."""
        found = {n: float(v) for n, v in self.model.noise.items()}
        for j, t in zip(
            self.model.estimated_noise, self.theta[self.model.slots.noise], strict=True
        ):
            found[self.model.names[j]] = float(np.exp(t))
        return {n: found[n] for n in self.model.names}

    def __getitem__(self, name: str) -> Estimate:
        """Estimate by name; diffusions are ``sigma PLACE``, noise ``noise READING``."""
        from bondgraph.support.errors import unknown_name

        for e in self.estimates:
            if e.name == name:
                return e
        raise unknown_name("estimate", name, repr(self), [e.name for e in self.estimates])

    @cached_property
    def predicted(self) -> tuple[Predicted, ...]:
        """Every record, held-out samples included, at the fitted values."""
        return tuple(self._predicted(r) for r in range(len(self.model.records)))

    def _predicted(self, record: int) -> Predicted:
        model, data = self.model, self.model.records[record]
        mask = np.isfinite(data.readings).astype(float)
        passed = pass_over(model, self.theta, record, mask)
        with np.errstate(invalid="ignore"):
            innovation = np.where(mask > 0, passed.innovation / np.sqrt(passed.variance), np.nan)
        x0, scale = model.rest[record].copy(), model.state_scale
        if model.slots.n_state:
            x0 = x0 + self.theta[model.slots.states(record)] * scale
        run = run_record(
            model.compiled, model.vector(self.theta), model.inputs[record], data.dt, x0,
            n_sub=model.n_sub, hold=data.hold,
        )  # fmt: skip
        offset = np.zeros(len(model.names))
        if model.slots.n_offset:
            offset = self.theta[model.slots.offsets(record)] * model.reading_scale
        return Predicted(
            passed.reading * model.reading_scale, innovation, passed.state * scale, run.y + offset
        )

    def rmse(self, part: str, kind: str = "reading", record: int = 0) -> dict[str, float]:
        """Root mean square error on ``train`` or ``test``, SI.

        Parameters
        ----------
        kind : {"reading", "simulated"}
            One step ahead, or free run.
        """
        data = self.model.records[record]
        with np.errstate(over="ignore", invalid="ignore"):
            error = data.readings - getattr(self.predicted[record], kind)
            square = error[data.mask(part)] ** 2
        columns = [c[~np.isnan(c)] for c in square.T]
        found = [float(np.sqrt(c.mean())) if c.size else float("nan") for c in columns]
        return dict(zip(self.model.names, found, strict=True))

    def __repr__(self) -> str:
        """Short text."""
        return (
            f"PredictionFit({self.model.graph.name!r}, {self.status.value}, "
            f"log-likelihood {self.log_likelihood:.6g})"
        )

    def __str__(self) -> str:
        """Values with intervals and the remarks, one a line."""
        lines = [repr(self)]
        for e in self.estimates:
            bound = "  (at its bound)" if e.at_bound else ""
            interval = f"[{e.ci95[0]:.5g}, {e.ci95[1]:.5g}]"
            lines.append(f"  {e.name} = {e.value:.6g} {e.unit}  {interval}{bound}")
        return "\n".join([*lines, *(f"  note: {r}" for r in self.remarks)])


def fit_prediction(
    model: PredictionModel,
    *,
    start: Array | None = None,
    max_iterations: int = 60,
    progress: Callable[[int, float], None] | None = None,
) -> PredictionFit:
    """Fit by the likelihood of the prediction errors.

    Parameters
    ----------
    start : ndarray, shape (n_theta,), optional
        Where to begin; the model's start values otherwise.
    progress : callable, optional
        Called with the iteration and the log-likelihood.
    """
    # tiny matrices: threads of the linear algebra only get in each other's way
    with threadpool_limits(1, user_api="blas"):
        begin = model.start() if start is None else np.asarray(start, float)
        found = maximise(model, begin, max_iterations=max_iterations, progress=progress)
        if _without_noise(model, found):
            # process noise can imitate the noise of a sensor; begin from the other end as well
            other = maximise(model, _quiet(model, begin), max_iterations=max_iterations)
            if other.at.log_likelihood > found.at.log_likelihood:
                found = other
        covariance, sandwich = _covariances(model, found)
        variance = np.maximum(np.diag(covariance), np.diag(sandwich))
        estimates = _estimates(model, found.theta, variance, found.at)
        made = PredictionFit(
            model, found.theta, found.status, found.iterations, found.at.log_likelihood,
            found.at.count, covariance, sandwich, estimates, (),
        )  # fmt: skip
        return replace(made, remarks=remarks(model, made))


def _without_noise(model: PredictionModel, found: Maximum) -> bool:
    """Whether the noise of a sensor has vanished."""
    at, (lower, _) = model.slots.noise, model.bounds()
    return bool((found.theta[at] <= lower[at] + 1e-6).any())


def _quiet(model: PredictionModel, begin: Array) -> Array:
    """Return a start with hardly any process noise, all misfit being noise of the sensors."""
    at, theta = model.slots, begin.copy()
    lower, upper = model.bounds()
    theta[at.sigma] = lower[at.sigma] + 1.0
    scale = model.reading_scale[list(model.estimated_noise)]
    theta[at.noise] = np.log(QUIET * scale)
    return np.asarray(np.clip(theta, lower, upper))


def _covariances(model: PredictionModel, found: Maximum) -> tuple[Array, Array]:
    lower, upper = model.bounds()
    inside = (found.theta > lower + 1e-9) & (found.theta < upper - 1e-9)
    information = found.at.information + prior(model, found.theta).information
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    inside &= size > 1e-9
    pick = np.ix_(inside, inside)
    unit = 1.0 / size[inside]
    scaled = information[pick] * np.outer(unit, unit)
    inverse = np.linalg.pinv(scaled, hermitian=True, rcond=1e-13) * np.outer(unit, unit)
    expected, robust = np.zeros_like(information), np.zeros_like(information)
    expected[pick] = inverse
    g = found.at.scores[:, inside]
    g = g - g.mean(axis=0) if g.shape[0] else g
    robust[pick] = inverse @ (g.T @ g) @ inverse
    return expected, robust


def _estimates(
    model: PredictionModel, theta: Array, variance: Array, now: LikelihoodEvaluation
) -> tuple[Estimate, ...]:
    at, (lower, upper) = model.slots, model.bounds()
    reach = 1.96 * np.sqrt(variance)
    stuck = (theta <= lower + 1e-9) | (theta >= upper - 1e-9)
    found = []
    for i, f in enumerate(model.free):
        ends = sorted((f.value(theta[i] - reach[i]), f.value(min(theta[i] + reach[i], 700.0))))
        entry = (f.parameter.name, f.value(theta[i]), f.parameter.unit, (ends[0], ends[1]))
        found.append(Estimate(*entry, bool(stuck[i])))
    units = [str(getattr(model.graph[n], "unit", "") or "1") for n in model.names]
    logs = [(f"sigma {d.place}", d.unit) for d in model.diffusions]
    logs += [(f"noise {model.names[j]}", units[j]) for j in model.estimated_noise]
    for i, (name, unit) in enumerate(logs, start=at.sigma.start):
        if i < at.sigma.stop and theta[i] <= lower[i] + 1e-9:
            found.append(Estimate(name, 0.0, unit, (0.0, _largest(now, theta, i)), True))
            continue
        away = min(float(reach[i]), 50.0)
        low, high = np.exp(theta[i] - away), np.exp(theta[i] + away)
        value = float(np.exp(theta[i]))
        found.append(Estimate(name, value, unit, (float(low), float(high)), bool(stuck[i])))
    for r, data in enumerate(model.records):
        for j in range(at.n_offset):
            k, scale = at.offsets(r).start + j, model.reading_scale[j]
            v, s = float(theta[k] * scale), float(reach[k] * scale)
            name = f"offset {model.names[j]}" + (f" of {data.name}" if at.n_records > 1 else "")
            found.append(Estimate(name, v, units[j], (v - s, v + s)))
    return tuple(found)


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
