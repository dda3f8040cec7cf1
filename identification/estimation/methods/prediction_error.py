"""Prediction errors: what a Kalman filter leaves of each reading, with process noise.

The filter and its likelihood are in `identification.estimation.prediction`; this puts a `Study`
before it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np

from bondgraph.graph.elements import Sensor
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.estimation.methods.method import FitTask, Method, MethodSolution
from identification.estimation.prediction.model import PredictionModel
from identification.estimation.prediction.result import PredictionFit, fit_prediction
from identification.study.engine import ExactEngine
from identification.study.joint import JointPoint, JointProblem
from identification.study.problem import Data, with_gains
from identification.study.residual import offset_scale, slots
from identification.study.study import SettledSetting, Study

FINEST = 32
MOVED = 0.3
"""Standard errors by which twice as many sub-steps may move an unknown."""
AWAY = 3.0
"""A free run this many spreads off its record says nothing: one-step predictions are shown."""


@final
@dataclass(frozen=True)
class PredictionError(Method):
    """Maximum likelihood of what a Kalman filter predicts one step ahead.

    Attributes
    ----------
    diffusion : tuple of str
        Where process noise may enter, as `PredictionModel` takes it; every state if left out.
    """

    diffusion: tuple[str, ...] | None = None
    name: ClassVar[str] = "prediction_error"
    hears_noise: ClassVar[bool] = True
    memory: ClassVar[str] = (
        "memory follows the filtered argument, with exact derivatives; its own uncertainty is "
        "left out"
    )

    def check(self, study: Study) -> None:
        """Refuse dead times, clocks, windows, numbers of single recordings, general equations."""
        _refuse(study)
        prediction_model(
            study, study.first_setting, study.stack(study.first_setting), self.diffusion
        )

    def solve(self, task: FitTask) -> MethodSolution:
        """Climb from `start`."""
        study, stack, start, options = task.study, task.stack, task.start, task.options
        model = prediction_model(study, task.setting, stack, self.diffusion)
        begin = model.start()
        _put(stack, model, start, begin)
        count = sum(int(np.isfinite(d.readings[d.mask("train")]).sum()) for d in model.records)
        trace: list[float] = []

        def heard(iteration: int, value: float) -> None:
            trace.append(_cost(model, value, count))
            if options.report is not None:
                options.report(iteration, trace[-1])

        found = fit_prediction(
            model, start=begin, max_iterations=options.max_iterations, progress=heard
        )
        model, found = _refined(study, model, found)
        end = _cost(model, found.log_likelihood, max(found.count, 1))
        readings, shown = _shown(stack, found)
        white = np.concatenate(
            [
                p.innovation[d.mask("train")].ravel()
                for p, d in zip(found.predicted, model.records, strict=True)
            ]
        )
        return MethodSolution(
            _taken(stack, found, start), found.status, (*(trace or [end]), end),
            _covariance(stack, found), (*_levels(found), *found.remarks, *_left_out(study), *shown),
            readings, cost=float(np.nanmean(white**2)),
        )  # fmt: skip


def _refined(
    study: Study, model: PredictionModel, found: PredictionFit
) -> tuple[PredictionModel, PredictionFit]:
    """Double the sub-steps of smooth laws until that moves no unknown by much."""
    while study.n_sub is None and model.compiled.n_w and model.n_sub < FINEST:
        finer = replace(model, n_sub=2 * model.n_sub)
        again = fit_prediction(finer, start=found.theta, max_iterations=10)
        error = np.sqrt(np.maximum(np.diag(again.covariance), 0.0))
        known = error > 0
        moved = np.abs(again.theta - found.theta)[known] / error[known]
        model, found = finer, again
        if moved.max(initial=0.0) < MOVED:
            break
    return model, found


def _refuse(study: Study) -> None:
    for e in study.graph.elements.values():
        drive = getattr(e, "drive", None)
        if getattr(e, "delay", None) or (drive is not None and drive.delay):
            raise UnusableInput(
                f"prediction_error: {e.name} has a dead time, which is no state of a filter; use "
                "method='single_shooting'"
            )
    if study.nuisances.clock:
        raise UnusableInput(
            "prediction_error: clock ratios cannot be fitted; resample the recording first or use "
            "method='single_shooting'"
        )
    if study.window is not None:
        raise UnusableInput(
            "prediction_error: the filter runs over whole recordings; leave out window, or use "
            "method='single_shooting'"
        )
    several = len(study.recordings) > 1
    if several and (own := sorted(study.own)):
        raise UnusableInput(
            f"prediction_error: {', '.join(own)} would have a value in every recording; make them "
            "common, fit the recordings one by one, or use method='single_shooting'"
        )


def prediction_model(
    study: Study,
    setting: SettledSetting,
    stack: JointProblem,
    diffusion: tuple[str, ...] | None = None,
) -> PredictionModel:
    """Return a study as a model with process noise; a recording without a sensor misses it.

    Parameters
    ----------
    stack : JointProblem
        ``study.stack(setting)``.
    diffusion : tuple of str, optional
        Where process noise may enter; every state if left out.
    """
    first = stack.problems[0]
    if not isinstance(first.engine, ExactEngine):
        raise UnusableInput(
            f"prediction_error: {study.graph.name} is not linear up to scalar laws; use "
            "method='single_shooting' or 'multiple_shooting'"
        )
    several = len(stack.problems) > 1
    graph = with_gains(study.graph, study.gains) if several else first.with_chain
    sensors = tuple(s.name for s in graph.of_type(Sensor))
    fresh = study.first_setting
    records = tuple(
        _with_all(replace(p.data, floor=floor), sensors)
        for p, floor in zip(stack.problems, fresh.floors, strict=False)
    )
    states, laws = first.engine.state_names, first.engine.compiled.space.laws
    smooth = study.n_sub is None and any(not port.law.set_valued for port in laws)
    fitted = {f.parameter.name for p in stack.problems for f in p.free}
    return PredictionModel(
        graph,
        records,
        tuple(states) if diffusion is None else diffusion,
        starts=first.starts,
        fixed=tuple(n for n in first.engine.parameter_names if n not in fitted),
        noise=_levels_of(study),
        initial=study.initial,
        offsets=study.nuisances.offsets,
        priors=first.scaled_priors,
        overrides=first.overrides,
        n_sub=max(*setting.n_sub, 2 if smooth else 1),
    )


def _levels_of(study: Study) -> dict[str, float]:
    """Return the known noise levels; one each for all recordings."""
    if isinstance(study.noise, str):
        return {}
    found = {}
    for name, given in study.noise.items():
        levels = (given,) if isinstance(given, int | float) else tuple(given)
        if len(set(levels)) > 1:
            raise UnusableInput(
                f"prediction_error: the noise of {name} differs between recordings; give one "
                "deviation, or use method='single_shooting'"
            )
        found[name] = float(levels[0])
    return found


def _with_all(data: Data, sensors: tuple[str, ...]) -> Data:
    """Add sensors that a recording lacks as missing readings."""
    readings, floor = np.full((data.n, len(sensors)), np.nan), np.zeros(len(sensors))
    for j, n in enumerate(sensors):
        if n in data.names:
            k = data.names.index(n)
            readings[:, j], floor[j] = data.readings[:, k], data.floor[k]
    return replace(data, readings=readings, names=sensors, floor=floor)


def _cost(model: PredictionModel, log_likelihood: float, count: int) -> float:
    """Geometric mean of the innovations' variances, over the variances of the readings."""
    scaled = log_likelihood + sum(
        float((np.isfinite(d.readings[d.mask("train")]) * np.log(model.reading_scale)).sum())
        for d in model.records
    )
    return float(np.exp(min(-2.0 * scaled / count - np.log(2.0 * np.pi) - 1.0, 700.0)))


# -- from one vector of unknowns to the other ------------------------------------------------


def _put(stack: JointProblem, model: PredictionModel, start: JointPoint, theta: Array) -> None:
    """Start values of a stack as theta of the filter."""
    known = dict(zip(stack.names, start.theta, strict=True))
    for i, f in enumerate(model.free):
        theta[i] = known.get(f.parameter.name, theta[i])
    at = model.slots
    for r, p in enumerate(stack.problems):
        local = stack.local(start, r)
        if at.n_offset:
            found = np.zeros(at.n_offset)
            for c, n in enumerate(p.data.names):
                size = offset_scale(p)[c]
                found[model.names.index(n)] = local.theta[slots(p).offsets][c] * size
            theta[at.offsets(r)] = found / model.reading_scale
        if at.n_state and np.isfinite(local.states[0]).all():
            theta[at.states(r)] = (local.states[0] - model.rest[r]) / model.state_scale
    lower, upper = model.bounds()
    np.clip(theta, lower, upper, out=theta)


def _taken(stack: JointProblem, fit: PredictionFit, start: JointPoint) -> JointPoint:
    """Unknowns of the stack from a fit; lags, which a filter does not know, are zero."""
    model, at = fit.model, fit.model.slots
    theta, states = start.theta.copy(), []
    mine = {f.parameter.name: i for i, f in enumerate(model.free)}
    for r, p in enumerate(stack.problems):
        columns, local = stack.columns[r], slots(p)
        for j, f in enumerate(p.free):
            theta[columns[j]] = fit.theta[mine[f.parameter.name]]
        theta[columns[local.lags]] = 0.0
        if at.n_offset:
            values = fit.theta[at.offsets(r)] * model.reading_scale
            picked = values[[model.names.index(n) for n in p.data.names]]
            theta[columns[local.offsets]] = picked / offset_scale(p)
        x0 = model.rest[r].copy()
        if at.n_state:
            x0 = x0 + fit.theta[at.states(r)] * model.state_scale
        states.append(np.tile(x0, (start.states[r].shape[0], 1)))
    return JointPoint(theta, tuple(states))


def _covariance(stack: JointProblem, fit: PredictionFit) -> Array:
    """Covariance in the stack's unknowns, widened where the robust one is wider."""
    model, at = fit.model, fit.model.slots
    expected = np.diag(fit.covariance)
    wider = np.sqrt(
        np.maximum(np.diag(fit.sandwich), expected) / np.where(expected > 0, expected, 1.0)
    )
    mine = {f.parameter.name: i for i, f in enumerate(model.free)}
    change = np.zeros((stack.n, at.size))
    for r, p in enumerate(stack.problems):
        columns, local = stack.columns[r], slots(p)
        for j, f in enumerate(p.free):
            change[columns[j], mine[f.parameter.name]] = 1.0
        for c, n in enumerate(p.data.names if at.n_offset else ()):
            k = model.names.index(n)
            size = model.reading_scale[k] / offset_scale(p)[c]
            change[columns[local.offsets][c], at.offsets(r).start + k] = size
    return np.asarray(change @ (fit.covariance * np.outer(wider, wider)) @ change.T)


# -- words and readings ----------------------------------------------------------------------


def _shown(stack: JointProblem, fit: PredictionFit) -> tuple[tuple[Array, ...], tuple[str, ...]]:
    """Return the free runs; the one-step predictions where a free run leaves its record."""
    model, found, left = fit.model, [], []
    for r, (p, seen) in enumerate(zip(stack.problems, fit.predicted, strict=True)):
        columns = [model.names.index(n) for n in p.data.names]
        with np.errstate(over="ignore", invalid="ignore"):
            off = np.sqrt(np.mean((seen.simulated[:, columns] - p.data.readings) ** 2, axis=0))
        near = bool((off < AWAY * p.data.readings.std(axis=0)).all())
        found.append((seen.simulated if near else seen.reading)[:, columns])
        if not near:
            left.append(model.records[r].name)
    words = (f"the free run leaves {', '.join(left)}: its readings shown are one-step predictions",)
    return tuple(found), words if left else ()


def _levels(fit: PredictionFit) -> tuple[str, ...]:
    """Process noise and noise of the readings with their intervals."""
    found = []
    for e in fit.estimates:
        if e.name.startswith(("sigma ", "noise ")):
            low, high = e.ci95
            found.append(f"{e.name} = {e.value:.4g} {e.unit} [{low:.4g}, {high:.4g}]")
    return tuple(found)


def _left_out(study: Study) -> tuple[str, ...]:
    found = []
    if study.nuisances.lags:
        found.append("lags of the sensors are not fitted by prediction errors: taken as zero")
    if study.noise == "coloured":
        found.append("readings' noise is taken as white; process noise colours the innovations")
    return tuple(found)
