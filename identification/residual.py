"""Residuals of a problem and their exact derivatives, initial states and nuisances eliminated.

The vector ``theta`` holds the free model parameters, one lag for each output (samples), the
declared delays (samples) and one offset for each output. The initial states of the windows are
eliminated one by one (variable projection, Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bondgraph.shift import delayed, delayed_within
from bondgraph.simulate import Run, prepare, run_prepared
from identification.problem import Problem

Array = np.ndarray


@dataclass(frozen=True)
class Point:
    """Where a fit stands.

    Attributes
    ----------
    theta : ndarray, shape (n_theta,)
        Scaled free parameters, lags and declared delays in samples, scaled offsets.
    states : ndarray, shape (n_windows, n_x), SI
    """

    theta: Array
    states: Array


@dataclass(frozen=True)
class Slots:
    """Places of the groups in ``theta``."""

    free: slice
    lags: slice
    delays: slice
    offsets: slice
    size: int


def slots(problem: Problem) -> Slots:
    """Layout of ``theta`` for `problem`."""
    f, y, d = len(problem.free), len(problem.data.names), len(problem.delays)
    return Slots(
        slice(0, f),
        slice(f, f + y),
        slice(f + y, f + y + d),
        slice(f + y + d, f + 2 * y + d),
        f + 2 * y + d,
    )


@dataclass(frozen=True)
class Evaluation:
    """Simulation at a point.

    Attributes
    ----------
    y : ndarray, shape (N, n_y)
        Readings as simulated, offsets and delays included; NaN outside of all windows.
    residual : ndarray, shape (M,)
        Weighted training residuals, window by window.
    jacobian : ndarray, shape (M, n_theta)
    local : list of (rows, matrix)
        Columns of the initial state of each window.
    """

    y: Array
    residual: Array
    jacobian: Array
    local: list[tuple[slice, Array]]


def windows(problem: Problem) -> list[slice]:
    """Windows of the record: one, or consecutive ones that do not straddle the split."""
    n = problem.data.n
    if problem.window is None:
        return [slice(0, n)]
    found = []
    for part in (problem.data.split.train, problem.data.split.test):
        start, stop = part.start or 0, part.stop if part.stop is not None else n
        count = max(1, round((stop - start) / problem.window))
        edges = np.linspace(start, stop, count + 1).astype(int)
        found += [slice(int(a), int(b)) for a, b in pairwise(edges) if b - a > 2]
    return sorted(found, key=lambda s: s.start)


def start_point(problem: Problem) -> Point:
    """Start values: nominal parameters, declared delays, no offset, rest as initial state."""
    at = slots(problem)
    theta = np.zeros(at.size)
    theta[at.delays] = [problem.starts.get(n, 0.0) / problem.data.dt for n in problem.delays]
    if problem.known_offsets:
        theta[at.offsets] = problem.known_offsets
    states = np.tile(problem.rest_state, (len(windows(problem)), 1))
    for i, s in enumerate(problem.compiled.space.states):
        known = problem.known_states.get(str(s.symbol))
        if known is not None and known.size == states.shape[0]:
            states[:, i] = known
    return Point(theta, states)


def offset_scale(problem: Problem) -> Array:
    """Spread of each reading, the unit of its offset, shape (n_y,)."""
    return np.asarray(np.maximum(problem.data.readings.std(axis=0), problem.data.floor))


def parameters_at(problem: Problem, theta: Array) -> Array:
    """Physical parameter vector, shape (n_p,)."""
    p = problem.start_vector.copy()
    names = problem.compiled.parameter_names
    for f, t in zip(problem.free, theta, strict=False):
        p[names.index(f.parameter.name)] = f.value(float(t))
    return p


def evaluate(problem: Problem, point: Point, *, derivatives: bool = True) -> Evaluation:
    """Simulate at `point`; with derivatives also the Jacobians."""
    data, compiled, at = problem.data, problem.compiled, slots(problem)
    names = compiled.parameter_names
    n_y, n_x = len(data.names), compiled.n_x
    p = parameters_at(problem, point.theta)
    directions = [names.index(f.parameter.name) for f in problem.free] if derivatives else []
    offsets = offset_scale(problem)
    lags = output_delays(problem, point.theta)
    y = np.full((data.n, n_y), np.nan)
    train = data.mask("train")
    weight = 1.0 / data.floor
    rows: list[Array] = []
    jacobians: list[Array] = []
    local: list[tuple[slice, Array]] = []
    filled = 0
    n_sub = problem.steps
    ready = prepare(compiled, p, data.dt, n_sub, directions, derivatives)
    for w, x0 in zip(windows(problem), point.states, strict=True):
        run = run_prepared(
            ready,
            problem.inputs[w],
            x0,
            fine=problem.fine_inputs(w),
            every_substep=bool(problem.delays),
        )
        if problem.delays:
            declared = lags - point.theta[at.lags]
            run, late = _declared_delays(run, n_y, declared, n_sub)
            simulated, shifts, tangent = _lagged(run, n_y, point.theta[at.lags], derivatives)
            shifts_declared = late
        else:
            simulated, shifts, tangent = _lagged(run, n_y, lags, derivatives)
            shifts_declared = shifts
        y[w] = simulated + point.theta[at.offsets] * offsets
        chosen = train[w]
        if not chosen.any():
            continue
        part = ((data.readings[w] - y[w]) * weight)[chosen]
        rows.append(part.ravel(order="F"))
        if derivatives:
            slopes = np.array(
                [f.slope(float(t)) for f, t in zip(problem.free, point.theta, strict=False)]
            )
            block = np.zeros((n_y, part.shape[0], at.size))
            block[:, :, at.free] = tangent[chosen][:, :, : slopes.size].transpose(1, 0, 2) * slopes
            for c in range(n_y):
                block[c, :, at.lags.start + c] = shifts[chosen, c]
                block[c, :, at.offsets.start + c] = offsets[c]
            for j, outputs in enumerate(problem.delays.values()):
                for c in outputs:
                    block[c, :, at.delays.start + j] = shifts_declared[chosen, c]
            block *= weight[:, None, None]
            jacobians.append(block.reshape(part.size, -1))
            states = tangent[chosen][:, :, slopes.size :].transpose(1, 0, 2) * weight[:, None, None]
            local.append((slice(filled, filled + part.size), states.reshape(part.size, n_x)))
        filled += part.size
    residual = np.concatenate(rows) if rows else np.zeros(0)
    jacobian = np.concatenate(jacobians) if jacobians else np.zeros((residual.size, 0))
    return Evaluation(y, residual, jacobian, local)


def _declared_delays(run: Run, n_y: int, delays: Array, n_sub: int) -> tuple[Run, Array]:
    """Return outputs after the declared delays, on the samples; derivative by the delays."""
    n = (run.y.shape[0] - 1) // n_sub + 1
    y, dy = np.empty((n, n_y)), np.empty((n, n_y, run.dy.shape[2]))
    slopes = np.empty((n, n_y))
    for c in range(n_y):
        y[:, c], slopes[:, c] = delayed_within(run.y[:, c], delays[c], n_sub)
        dy[:, c] = delayed_within(run.dy[:, c], delays[c], n_sub)[0]
    return replace(run, y=y, dy=dy, s=run.s[::n_sub], w=run.w[::n_sub]), slopes


def _lagged(run: Run, n_y: int, lags: Array, derivatives: bool) -> tuple[Array, Array, Array]:
    """Delay the outputs; also their derivatives by the delay and by everything else."""
    simulated, tangent = run.y[:, :n_y].copy(), run.dy[:, :n_y]
    shifts = np.zeros_like(simulated)
    if not derivatives and not lags.any():
        return simulated, shifts, tangent
    if lags.any():
        tangent = tangent.copy()
    for c in range(n_y):
        simulated[:, c], shifts[:, c] = delayed(run.y[:, c], lags[c])
        if derivatives and lags[c]:
            tangent[:, c] = delayed(run.dy[:, c], lags[c])[0]
    return simulated, shifts, tangent


def output_delays(problem: Problem, theta: Array) -> Array:
    """Total delay of each output in samples, shape (n_y,)."""
    at = slots(problem)
    lags = theta[at.lags].copy()
    for j, outputs in enumerate(problem.delays.values()):
        for c in outputs:
            lags[c] += theta[at.delays][j]
    return np.asarray(lags)
