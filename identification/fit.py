"""Levenberg-Marquardt on the projected residuals: exact derivatives, bounds, a status in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from scipy.optimize import lsq_linear

from identification.problem import Problem
from identification.residual import (
    Evaluation,
    Point,
    evaluate,
    offset_scale,
    parameters_at,
    slots,
    start_point,
    windows,
)

Array = np.ndarray
NUISANCE_LAG = 0.25
# a quarter of a sample: filters and multiplexers; more is a finding
LARGEST_STEP = 1.5


class Status(Enum):
    """How a fit ended, in words."""

    CONVERGED = "converged"
    NO_PROGRESS = "stopped: no step lowers the misfit any more (flat or kinked valley)"
    ITERATIONS = "stopped at the largest number of iterations; raise max_iterations"
    BROKEN = "failed: the simulation is not finite at the start values; give other starts"


@dataclass(frozen=True)
class Estimate:
    """A fitted number with its 95 % interval."""

    name: str
    value: float
    unit: str
    ci95: tuple[float, float]
    at_bound: bool = False


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a fit.

    Attributes
    ----------
    cost : float
        Mean square of the weighted training residuals (1 = at the noise floor).
    simulated : ndarray, shape (N, n_y), SI
        Readings of the fitted model on the whole record.
    estimates, nuisances : tuple of Estimate
    """

    problem: Problem
    point: Point
    status: Status
    cost: float
    iterations: int
    simulated: Array
    estimates: tuple[Estimate, ...] = ()
    nuisances: tuple[Estimate, ...] = ()

    def residuals(self, part: str) -> Array:
        """Measured less simulated on ``train`` or ``test``, shape (n, n_y), SI."""
        m = self.problem.data.mask(part)
        return np.asarray(self.problem.data.readings[m] - self.simulated[m])

    def rmse(self, part: str) -> dict[str, float]:
        """Root mean square error of each reading, SI."""
        r = self.residuals(part)
        return {
            n: float(np.sqrt(np.mean(r[:, c] ** 2))) for c, n in enumerate(self.problem.data.names)
        }

    def chi2(self, part: str) -> float:
        """Mean square residual over the noise floor, all readings."""
        return float(np.mean((self.residuals(part) / self.problem.data.floor) ** 2))

    @property
    def values(self) -> dict[str, float]:
        """All model parameters by name, declared delays (s) included."""
        names = self.problem.compiled.parameter_names
        found = dict(
            zip(names, map(float, parameters_at(self.problem, self.point.theta)), strict=True)
        )
        delays = self.point.theta[slots(self.problem).delays]
        for n, d in zip(self.problem.delays, delays, strict=True):
            found[n] = float(d) * self.problem.data.dt
        return found

    def __repr__(self) -> str:
        """Short text."""
        return f"Fit({self.problem.graph.name!r}, {self.status.value}, cost {self.cost:.4g})"


Cancelled = Callable[[], bool]


def fit(problem: Problem, *, max_iterations: int = 40, start: Point | None = None) -> Fit:
    """Fit `problem` by output error.

    Priors keep what the data do not determine near its start value: a factor 20 on logarithmic
    parameters, ten scales on others; they weigh nothing where the data speak.
    """
    point = start_point(problem) if start is None else start
    lower, upper = _bounds(problem)
    point = replace(point, theta=np.clip(point.theta, lower, upper))
    now = evaluate(problem, point)
    cost = _cost(problem, now, point)
    if not np.isfinite(cost):
        return Fit(problem, point, Status.BROKEN, np.inf, 0, now.y)
    damping, status, iteration = 1e-3, Status.ITERATIONS, 0
    for iteration in range(1, max_iterations + 1):  # noqa: B007 (used after the loop)
        system = _normal(problem, now, point)
        while True:
            trial = _step(problem, system, point, damping, lower, upper)
            after = evaluate(problem, trial)
            trial_cost = _cost(problem, after, trial)
            if np.isfinite(trial_cost) and trial_cost <= cost:
                break
            damping *= 8.0
            if damping > 1e9:
                break
        if damping > 1e9:
            freed = _unstick(problem, point, cost)
            if freed is None:
                status = Status.NO_PROGRESS
                break
            (point, now, cost), damping = freed, 1e-2
            continue
        gain = (cost - trial_cost) / max(cost, 1e-300)
        moved = float(np.abs(trial.theta - point.theta).max(initial=0.0))
        point, now, cost = trial, after, trial_cost
        damping = max(damping / 6.0, 1e-9)
        if gain < 1e-5 or (gain < 1e-3 and moved < 1e-4):
            status = Status.CONVERGED
            break
    return _finish(problem, point, now, status, iteration, lower, upper)


def _unstick(problem: Problem, point: Point, cost: float) -> tuple[Point, Evaluation, float] | None:
    """Move the windows' states on their own when no joint step lowers the misfit."""
    if problem.window is None:
        return None
    moved = refine_states(problem, point, passes=4)
    after = evaluate(problem, moved)
    new = _cost(problem, after, moved)
    return (moved, after, new) if new < cost * (1 - 1e-3) else None


def start_cost(problem: Problem) -> float:
    """Misfit at the start values, for choosing among many; infinite when it cannot be simulated."""
    point = start_point(problem)
    lower, upper = _bounds(problem)
    point = replace(point, theta=np.clip(point.theta, lower, upper))
    e = evaluate(problem, point, derivatives=False)
    r = e.residual - np.mean(e.residual) if e.residual.size else e.residual
    cost = float(np.mean(r**2)) if r.size else np.inf
    return cost if np.isfinite(cost) else np.inf


@dataclass(frozen=True)
class _System:
    """Compressed least squares: triangular factor of [J r] and how states follow theta."""

    factor: Array
    right: Array
    states: list[tuple[Array, Array]]


def _prior(problem: Problem) -> tuple[Array, Array]:
    """Weights (per residual of one sigma) and centres of the priors on theta."""
    at = slots(problem)
    weight, centre = np.zeros(at.size), np.zeros(at.size)
    weight[at.free] = [1.0 / 3.0 if f.log else 0.1 for f in problem.free]
    weight[at.lags] = 1.0
    weight[at.delays] = 1e-3
    weight[at.offsets] = 0.1
    return weight, centre


def _bounds(problem: Problem) -> tuple[Array, Array]:
    at = slots(problem)
    lower, upper = np.full(at.size, -np.inf), np.full(at.size, np.inf)
    for i, f in enumerate(problem.free):
        lower[i], upper[i] = f.bounds()
    lag = NUISANCE_LAG if problem.nuisances and problem.window is None else 0.0
    lower[at.lags], upper[at.lags] = -lag, lag
    for outputs in problem.delays.values():
        for c in outputs:  # a declared dead time takes the place of the nuisance
            lower[at.lags.start + c] = upper[at.lags.start + c] = 0.0
    lower[at.delays], upper[at.delays] = 0.0, 0.1 * problem.data.n
    if not problem.nuisances or problem.window is not None:
        lower[at.offsets] = upper[at.offsets] = 0.0
    return lower, upper


def _cost(problem: Problem, e: Evaluation, point: Point) -> float:
    weight, _ = _prior(problem)
    with np.errstate(over="ignore", invalid="ignore"):
        total = float(e.residual @ e.residual) + float(np.sum((weight * point.theta) ** 2))
        away = (point.states - problem.rest_state) / (10.0 * problem.state_scale)
        total += float(np.sum(away**2)) if problem.window is None else 0.0
    return total / max(e.residual.size, 1)


def _normal(problem: Problem, e: Evaluation, point: Point) -> _System:
    weight, _ = _prior(problem)
    pieces, states = [], []
    scale = problem.state_scale
    for (rows, local), x0 in zip(e.local, _scored_states(problem, point), strict=True):
        stacked = np.vstack([local * scale, 0.1 * np.eye(local.shape[1])])
        pull = (
            -0.1 * (x0 - problem.rest_state) / scale
            if problem.window is None
            else np.zeros(local.shape[1])
        )
        right = np.concatenate([e.residual[rows], pull])
        body = np.vstack([e.jacobian[rows], np.zeros((local.shape[1], e.jacobian.shape[1]))])
        q, r = np.linalg.qr(stacked)
        by_theta, by_residual = q.T @ body, q.T @ right
        states.append((np.linalg.solve(r, by_theta), np.linalg.solve(r, by_residual)))
        pieces.append(np.hstack([body - q @ by_theta, (right - q @ by_residual)[:, None]]))
    n = e.jacobian.shape[1]
    prior = np.hstack([np.diag(weight), (-weight * point.theta)[:, None]])
    compressed = np.asarray(np.linalg.qr(np.vstack([*pieces, prior]), mode="r"))
    return _System(compressed[:, :n], compressed[:, n], states)


def _scored_states(problem: Problem, point: Point) -> list[Array]:
    train = problem.data.mask("train")
    return [x for w, x in zip(windows(problem), point.states, strict=True) if train[w].any()]


def _step(
    problem: Problem, system: _System, point: Point, damping: float, lower: Array, upper: Array
) -> Point:
    size = np.linalg.norm(system.factor, axis=0) + 1e-12
    if not np.isfinite(size).all() or not np.isfinite(system.right).all():
        return Point(point.theta * np.nan, point.states)
    a = np.vstack([system.factor, np.sqrt(damping) * np.diag(size)])
    b = np.concatenate([system.right, np.zeros(size.size)])
    low = np.maximum(lower - point.theta, _least(problem, -LARGEST_STEP))
    high = np.minimum(upper - point.theta, _least(problem, LARGEST_STEP))
    high = np.maximum(high, low)
    free = high > low
    delta = np.zeros(size.size)
    delta[free] = np.linalg.lstsq(a[:, free], b, rcond=None)[0]
    if ((delta < low) | (delta > high)).any():
        solved = lsq_linear(
            a[:, free] / size[free],
            b,
            (low[free] * size[free], high[free] * size[free]),
            method="bvls",
        )
        delta = np.zeros(size.size)
        delta[free] = solved.x / size[free]
        delta = np.clip(delta, low, high)
    states = point.states.copy()
    train = problem.data.mask("train")
    scored = [i for i, w in enumerate(windows(problem)) if train[w].any()]
    for i, (by_theta, by_residual) in zip(scored, system.states, strict=True):
        states[i] = states[i] + (by_residual - by_theta @ delta) * problem.state_scale
    return Point(point.theta + delta, states)


def _least(problem: Problem, step: float) -> Array:
    """Largest change of a logarithmic parameter in one step; others are free."""
    at = slots(problem)
    limit = np.full(at.size, np.inf * np.sign(step))
    limit[at.free] = [step if f.log else np.inf * np.sign(step) for f in problem.free]
    return limit


def _finish(
    problem: Problem,
    point: Point,
    e: Evaluation,
    status: Status,
    iterations: int,
    lower: Array,
    upper: Array,
) -> Fit:
    if problem.window is not None:
        point = _held_out_states(problem, point)
    estimates, nuisances = _estimates(problem, point, e, lower, upper)
    y = evaluate(problem, point, derivatives=False).y
    cost = float(np.mean(e.residual**2)) if e.residual.size else np.inf
    return Fit(problem, point, status, cost, iterations, y, estimates, nuisances)


def _held_out_states(problem: Problem, point: Point) -> Point:
    """Fit initial states of the held-out windows, as an observer would; parameters kept."""
    data = problem.data
    swapped = replace(data.split, train=data.split.test, test=data.split.train)
    return refine_states(replace(problem, data=replace(data, split=swapped)), point)


def refine_states(problem: Problem, point: Point, passes: int = 12) -> Point:
    """Improve the initial states of the training windows, parameters kept.

    Damped Gauss-Newton, window by window: a window keeps its state unless its own misfit falls,
    so that one window at a kink (sticking friction) does not hold up the others.
    """
    states, scale = point.states.copy(), problem.state_scale
    train = problem.data.mask("train")
    scored = [i for i, w in enumerate(windows(problem)) if train[w].any()]
    damping = np.full(len(scored), 1e-6)
    now = evaluate(problem, Point(point.theta, states))
    for _ in range(passes):
        trial = states.copy()
        for k, (i, (rows, local)) in enumerate(zip(scored, now.local, strict=True)):
            a = local * scale
            size = np.sqrt(damping[k]) * np.diag(np.linalg.norm(a, axis=0) + 1e-9)
            right = np.concatenate([now.residual[rows], np.zeros(scale.size)])
            trial[i] += np.linalg.lstsq(np.vstack([a, size]), right, rcond=1e-12)[0] * scale
        after = evaluate(problem, Point(point.theta, trial))
        gain = 0.0
        for k, (i, (rows, _)) in enumerate(zip(scored, now.local, strict=True)):
            old = float(now.residual[rows] @ now.residual[rows])
            new = float(after.residual[rows] @ after.residual[rows])
            if np.isfinite(new) and new <= old:
                states[i] = trial[i]
                damping[k] = max(damping[k] / 10, 1e-12)
                gain = max(gain, (old - new) / max(old, 1e-300))
            else:
                damping[k] = min(damping[k] * 100, 1e6)
                gain = max(gain, 1e-2)
        now = evaluate(problem, Point(point.theta, states))
        if gain < 1e-4:
            break
    return Point(point.theta, states)


def _estimates(
    problem: Problem, point: Point, e: Evaluation, lower: Array, upper: Array
) -> tuple[tuple[Estimate, ...], tuple[Estimate, ...]]:
    """Values with intervals from the block sandwich: right for coloured residuals too."""
    at = slots(problem)
    covariance = _sandwich(problem, e, point)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    found: list[Estimate] = []
    nuisances: list[Estimate] = []
    for i, f in enumerate(problem.free):
        t = float(point.theta[i])
        ends = sorted((f.value(t - 1.96 * sd[i]), f.value(min(t + 1.96 * sd[i], 700.0))))
        at_bound = bool(t <= lower[i] + 1e-9 or t >= upper[i] - 1e-9)
        entry = Estimate(
            f.parameter.name, f.value(t), f.parameter.unit, (ends[0], ends[1]), at_bound
        )
        (nuisances if f.parameter.name.startswith("offset_") else found).append(entry)
    dt = problem.data.dt
    for j, n in enumerate(problem.delays):
        k = at.delays.start + j
        v, s = point.theta[k] * dt, 1.96 * sd[k] * dt
        found.append(Estimate(n, float(v), "s", (float(v - s), float(v + s))))
    lags = point.theta[at.lags]
    scale = offset_scale(problem)
    for c, n in enumerate(problem.data.names):
        k, o = at.lags.start + c, at.offsets.start + c
        if upper[k] > lower[k]:
            v, s = lags[c] * dt, 1.96 * sd[k] * dt
            hit = bool(abs(lags[c]) >= NUISANCE_LAG - 1e-9)
            nuisances.append(
                Estimate(f"delay {n}", float(v), "s", (float(v - s), float(v + s)), hit)
            )
        if upper[o] > lower[o]:
            v, s = point.theta[o] * scale[c], 1.96 * sd[o] * scale[c]
            unit = getattr(problem.graph[n], "unit", "")
            nuisances.append(Estimate(f"offset {n}", float(v), unit, (float(v - s), float(v + s))))
    return tuple(found), tuple(nuisances)


def _sandwich(problem: Problem, e: Evaluation, point: Point, blocks: int = 40) -> Array:
    system = _normal(problem, e, point)
    n = system.factor.shape[1]
    gram = system.factor.T @ system.factor + 1e-12 * np.eye(n)
    inverse = np.linalg.pinv(gram, hermitian=True)
    middle = np.zeros((n, n))
    for part in np.array_split(np.arange(e.residual.size), blocks):
        g = e.jacobian[part].T @ e.residual[part]
        middle += np.outer(g, g)
    robust = inverse @ middle @ inverse
    return np.maximum(np.diag(np.diag(inverse)), np.diag(np.diag(robust)))


def best(fits: list[Fit]) -> Fit:
    """Fit with the lowest training cost."""
    return min(fits, key=lambda f: f.cost)
