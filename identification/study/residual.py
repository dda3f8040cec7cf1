"""Residuals of a problem and their exact derivatives, initial states and nuisances eliminated.

The vector ``theta`` holds the free model parameters, one lag for each output (samples), the
declared delays (samples) and clocks (ratio error over the time between samples), one offset for
each output and, if they are fitted, one ratio error for each sensor's clock (over the largest one).
The initial states of the windows are eliminated one by one (variable projection, Golub and Pereyra,
SIAM J. Numer. Anal. 10 (1973) 413).
"""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate, pairwise
from typing import TypeVar

import numpy as np

from bondgraph.signals.fractional_delay import delayed, delayed_values, delayed_within, warped
from bondgraph.signals.varying_delay import warped_within
from bondgraph.simulation.dynamics import Dynamics
from bondgraph.simulation.exact_run import KernelRun, Prepared, run_many
from bondgraph.simulation.located import DifferenceSteps
from bondgraph.support.arrays import Array
from identification.study.problem import Problem

Ready = TypeVar("Ready")


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
class ThetaSlots:
    """Places of the groups in ``theta``."""

    free: slice
    lags: slice
    delays: slice
    offsets: slice
    clocks: slice
    size: int


def slots(problem: Problem) -> ThetaSlots:
    """Layout of ``theta`` for `problem`."""
    return _slots(
        len(problem.free), len(problem.data.names), len(problem.delays), bool(problem.clock)
    )


@lru_cache(maxsize=64)
def _slots(n_free: int, y: int, n_delays: int, clocks: bool) -> ThetaSlots:
    sizes = (0, n_free, y, n_delays, y, y if clocks else 0)
    edges = tuple(accumulate(sizes))
    free, lags, delays, offsets, own = (slice(a, b) for a, b in pairwise(edges))
    return ThetaSlots(free, lags, delays, offsets, own, edges[-1])


@dataclass(frozen=True)
class ResidualEvaluation:
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

    @property
    def cost(self) -> float:
        """Mean square of the residual; infinite where nothing is scored."""
        return float(np.mean(self.residual**2)) if self.residual.size else np.inf


def windows(problem: Problem) -> list[slice]:
    """Windows: one for each recording, or shorter ones that do not straddle the split.

    A free state begins at `Data.begin`, one that is known at the first sample.
    """
    return list(problem.windows)


def start_point(problem: Problem) -> Point:
    """Start values: nominal parameters, declared delays, no offset, rest as initial state."""
    at = slots(problem)
    theta = np.zeros(at.size)
    theta[at.delays] = [v / problem.data.dt for v in problem.late_starts.values()]
    if problem.known_offsets:
        theta[at.offsets] = problem.known_offsets
    states = np.tile(problem.rest_state, (len(windows(problem)), 1))
    for i, name in enumerate(problem.dynamics.state_names):
        known = problem.known_states.get(name)
        if known is not None and known.size == states.shape[0]:
            states[:, i] = known
    return Point(theta, states)


def offset_scale(problem: Problem) -> Array:
    """Spread of each reading, the unit of its offset, shape (n_y,)."""
    return np.asarray(np.maximum(problem.data.spread, problem.data.floor))


def parameters_at(problem: Problem, theta: Array) -> Array:
    """Physical parameter vector, shape (n_p,)."""
    p = problem.start_vector.copy()
    for i, f, t in zip(problem.directions, problem.free, theta, strict=False):
        p[i] = f.value(float(t))
    return p


def values_at(problem: Problem, theta: Array) -> dict[str, float]:
    """Return all parameters by name, SI, declared delays included."""
    found = dict(zip(problem.dynamics.parameter_names, parameters_at(problem, theta), strict=True))
    found |= zip(problem.delays, theta[slots(problem).delays] * problem.data.dt, strict=True)
    return {n: float(v) for n, v in found.items()}


def evaluate(
    problem: Problem,
    point: Point,
    *,
    derivatives: bool = True,
    by_parameters: bool = True,
    scored: bool = False,
    among: Container[int] | None = None,
    limit: float = np.inf,
) -> ResidualEvaluation:
    """Simulate at `point`; with derivatives also the Jacobians.

    Without `by_parameters` derivatives are those by the initial states alone, the Jacobian's
    columns of free parameters are zero. With `scored` only the windows that have training samples
    are simulated, of those `among` these numbers. Beyond a sum of squares of `limit` nothing more
    is, and the residual is infinite.
    """
    data, dynamics, at = problem.data, problem.dynamics, slots(problem)
    n_y = len(data.names)
    p = parameters_at(problem, point.theta)
    directions = problem.directions if derivatives and by_parameters else []
    if problem.apart and not point.theta[at.lags].any():
        step = data.step(problem.windows[0])
        alike = dynamics.prepare(p, step, problem.steps, directions, derivatives)
        if alike.many is not None:
            wanted = [k for k in range(len(problem.windows)) if among is None or k in among]
            return _apart(problem, point, alike, wanted, scored=scored, limit=limit)
    n_free = len(directions)
    slopes = problem.slopes(point.theta)
    offsets = offset_scale(problem)
    y = np.full((data.n, n_y), np.nan)
    train = data.mask("train")
    rows: list[Array] = []
    jacobians: list[Array] = []
    local: list[tuple[slice, Array]] = []
    filled, total = 0, 0.0
    rest = lru_cache(maxsize=None)(
        lambda at: rest_under(dynamics, p, problem.inputs[at], directions)
    )
    ready = by_step(lambda h: dynamics.prepare(p, h, problem.steps, directions, derivatives))
    for number, (w, x0) in enumerate(zip(windows(problem), point.states, strict=True)):
        chosen = train[w]
        shown = bool(chosen.any())
        if (scored and not shown) or (among is not None and number not in among):
            continue
        begin = max((b for b in data.starts if b <= w.start), default=0)
        x0, by_p = rest(begin) if problem.initial == "rest" else (x0, None)
        run = dynamics.run(
            ready(data.step(w)),
            problem.inputs[w],
            x0,
            problem.fine_inputs(w),
            every_substep=bool(problem.delays),
            memory=time_memories(problem, w.start),
            after=data.reads_after,
        )
        own = slopes if derivatives else None
        run = _followed(problem, p, w, x0, run, own if by_parameters else slopes[:0])
        begun = w.start - begin
        seen = read_out(
            problem, run, point.theta,
            derivatives=derivatives, first=begun, stretch=data.dt / data.step(w),
        )  # fmt: skip
        y[w] = seen.y + point.theta[at.offsets] * offsets
        if problem.correction is not None:
            y[w] += problem.correction[w]
        if not shown:
            continue
        part = weighted(problem, (data.readings[w] - y[w])[chosen].T[:, :, None])
        rows.append(part.ravel())
        with np.errstate(over="ignore"):  # what runs away is beyond any limit
            total += float(rows[-1] @ rows[-1])
        if total > limit:
            return ResidualEvaluation(y, np.full(1, np.inf), np.zeros((1, at.size)), [])
        if derivatives:
            tangent = seen.tangent[chosen]
            by_start = tangent[:, :, n_free:]
            block = sensor_columns(problem, seen, chosen)
            by_free = tangent[:, :, :n_free]
            if by_p is not None:
                by_free = by_free + by_start @ by_p
            if n_free:
                block[:, :, at.free] = by_free.transpose(1, 0, 2) * slopes
            for j, (name, outputs) in enumerate(problem.delays.items()):
                passed = data.step(w) * (begun + np.flatnonzero(chosen))
                grown = -passed if name in problem.skews else 1.0
                for c in outputs:
                    block[c, :, at.delays.start + j] = seen.by_delay[chosen, c] * grown
            jacobians.append(weighted(problem, block).reshape(part.size, -1))
            states = by_start[:, :, problem.free_states].transpose(1, 0, 2)
            states = weighted(problem, states).reshape(part.size, -1)
            local.append((slice(filled, filled + part.size), states))
        filled += part.size
    before = windows(problem)[0].start if problem.window is None else 0
    y[:before] = y[before]  # the model stands still where it begins
    residual = np.concatenate(rows) if rows else np.zeros(0)
    jacobian = np.concatenate(jacobians) if jacobians else np.zeros((residual.size, 0))
    return ResidualEvaluation(y, residual, jacobian, local)


def _apart(
    problem: Problem,
    point: Point,
    ready: Prepared,
    chosen: Sequence[int],
    *,
    scored: bool,
    limit: float,
) -> ResidualEvaluation:
    """Evaluate short windows that have nothing to do with each other, all of them in one call."""
    data, at, n_y = problem.data, slots(problem), len(problem.data.names)
    train, all_windows, n_d = data.mask("train"), windows(problem), ready.n_d
    own = [k for k in chosen if not scored or train[all_windows[k]].any()]
    y = np.full((data.n, n_y), np.nan)
    tangent = np.zeros((data.n, n_y, n_d))
    if own:
        inputs = [problem.inputs[all_windows[k]] for k in own]
        fine = [problem.fine_inputs(all_windows[k]) for k in own]
        made, slopes = run_many(ready, inputs, point.states[own], fine)
        rows = np.concatenate([np.arange(all_windows[k].start, all_windows[k].stop) for k in own])
        y[rows], tangent[rows] = made[:, :n_y], slopes[:, :n_y]
    y += point.theta[at.offsets] * offset_scale(problem)
    if problem.correction is not None:
        y += problem.correction
    left = (data.readings - y) / data.floor
    tangent /= data.floor[:, None]
    n_free = ready.n_p
    tangent[:, :, :n_free] *= problem.slopes(point.theta)[:n_free]
    offsets = np.diag(offset_scale(problem) / data.floor)
    residuals, jacobians, local = [], [], []
    filled = 0
    for k in own:
        w = all_windows[k]
        shown = w.start + np.flatnonzero(train[w])
        if not shown.size:
            continue
        residuals.append(left[shown].T.ravel())
        size = residuals[-1].size
        if n_d:
            by = tangent[shown].transpose(1, 0, 2).reshape(size, n_d)
            block = np.zeros((n_y, shown.size, at.size))
            block[:, :, at.free.start : at.free.start + n_free] = by[:, :n_free].reshape(
                n_y, shown.size, n_free
            )
            block[:, :, at.offsets] = offsets[:, None]
            jacobians.append(block.reshape(size, -1))
            local.append((slice(filled, filled + size), by[:, n_free:][:, problem.free_states]))
        filled += size
    residual = np.concatenate(residuals) if residuals else np.zeros(0)
    with np.errstate(over="ignore"):  # what runs away is beyond any limit
        if float(residual @ residual) > limit:
            return ResidualEvaluation(y, np.full(1, np.inf), np.zeros((1, at.size)), [])
    jacobian = np.concatenate(jacobians) if jacobians else np.zeros((residual.size, 0))
    return ResidualEvaluation(y, residual, jacobian, local)


def _followed(
    problem: Problem, p: Array, w: slice, x0: Array, run: KernelRun, slopes: Array | None
) -> KernelRun:
    """Return a run whose readings are followed to where laws jump, with `slopes` their derivatives.

    From so many sub-steps on that they are asked for, and where nothing is needed within samples.
    Derivatives of whole steps place a jump at the end of one: of a few unknowns those of the
    followed readings are taken by differences.
    """
    data, dynamics = problem.data, problem.dynamics
    if problem.n_sub < LOCATED or problem.delays or data.parts > 1 or not dynamics.jumps:
        return run
    memory, reach = time_memories(problem, w.start), None
    if slopes is not None and slopes.size + dynamics.n_x <= MOVED:
        by_p = SMALL * np.abs(slopes)
        reach = DifferenceSteps(problem.directions[: by_p.size], by_p, SMALL * problem.state_scale)
    accuracy = float(np.clip(FINE * np.min(data.floor / offset_scale(problem)), *ACCURACY))
    found = dynamics.followed(
        p, problem.inputs[w], data.step(w), x0, data.between, memory, run, reach, accuracy,
        after=data.reads_after,
    )  # fmt: skip
    if found is None:
        return run
    y, dy = found
    return replace(run, y=y, dy=run.dy if reach is None else dy)


MOVED = 14
"""Unknowns and states of which derivatives are taken by differences: more would take too long."""
SMALL = 1e-3
"""Part of a parameter, or of what a state moves by, that derivatives are taken by."""
FINE, ACCURACY = 0.01, (1e-6, 1e-5)
"""Part of the noise up to which followed readings are right, and its limits over their spread."""
LOCATED = 4
"""Sub-steps a sample from which a law that jumps is followed to where it does, at any moment."""


def by_step(prepare: Callable[[float], Ready]) -> Callable[[float], Ready]:
    """Return what is prepared for each time between samples, once."""
    return lru_cache(maxsize=None)(prepare)


def time_memories(problem: Problem, first: int) -> dict[str, tuple[float, ...]] | None:
    """Memory of the laws that count time (`counts_time`), where a window begins within the record.

    Their only memory is the time since the start of the record, s; None where there is nothing to
    say. Laws of any other kind start every window virgin.
    """
    if not first or not problem.timed:
        return None
    time = problem.data.time
    return dict.fromkeys(problem.timed, (float(time[first] - time[0]),))


def weighted(problem: Problem, block: Array) -> Array:
    """Divide by the floor, channel by channel, and whiten coloured noise along time.

    `block` has shape (n_y, n, columns). The first samples, which the filter does not know the past
    of, are not scored.
    """
    from scipy.signal import lfilter

    block = block / problem.data.floor[:, None, None]
    for c, polynomial in enumerate(problem.whitening):
        order = polynomial.size - 1
        if order and block.shape[2]:
            block[c] = lfilter(polynomial, [1.0], block[c], axis=0)
            block[c, :order] = 0.0
    return np.asarray(block)


def rest_under(
    dynamics: Dynamics, p: Array, inputs: Array, directions: Sequence[int]
) -> tuple[Array, Array]:
    """Return the rest under constant inputs, and its derivative by some of the parameters.

    Where nothing moves, and nothing does after all of them have changed, there is no derivative.
    """
    x = dynamics.rest(p, inputs)
    if not directions:
        return x, np.zeros((dynamics.n_x, 0))
    columns = []
    if not x.any():
        other, moved = p.copy(), list(directions)
        # each by another share: what balances now does not go on to do so
        shares = 1e-6 * (1.0 + np.sqrt(2.0) * np.arange(len(moved)) % 1.0)
        other[moved] += shares * np.maximum(np.abs(p[moved]), 1e-30)
        if not dynamics.rest(other, inputs).any():
            return x, np.zeros((dynamics.n_x, len(directions)))
    for i in directions:
        h = 1e-6 * max(abs(p[i]), 1e-30)
        ends = [p.copy(), p.copy()]
        ends[0][i] += h
        ends[1][i] -= h
        high, low = (dynamics.rest(e, inputs) for e in ends)
        columns.append((high - low) / (2 * h))
    return x, np.stack(columns, axis=1)


@dataclass(frozen=True)
class SampledReadings:
    """Readings with delays and clocks, and their derivatives, shapes (N, n_y) and (N, n_y, n_d)."""

    y: Array
    tangent: Array
    by_lag: Array
    by_delay: Array
    by_clock: Array


def read_out(
    problem: Problem,
    run: KernelRun,
    theta: Array,
    *,
    derivatives: bool,
    first: int = 0,
    stretch: float = 1.0,
) -> SampledReadings:
    """Return what the sensors say of a run: lags, dead times and clocks; no offsets.

    `first` is the sample of its recording at which the run begins: clocks count from its start.
    `stretch` is the mean time between samples over that of this recording: delays are given
    in the former.
    """
    at, n_y = slots(problem), len(problem.data.names)
    lags, own = stretch * output_delays(problem, theta), stretch * theta[at.lags]
    by_delay: Array | None = None
    if problem.delays:
        declared = lags - own
        if problem.skews:
            declared = _grown_delays(problem, theta, declared, run, first, stretch)
        still = first in (0, problem.data.begin)  # it rests before either
        run, by_delay = _declared_delays(run, n_y, declared, problem.steps, resting=still)
        by_delay = stretch * by_delay
        lags = own
    if problem.clock:
        samples = np.arange(first, first + run.y.shape[0], dtype=float)[:, None]
        # theta of a clock is its ratio error over the largest one
        late = lags - theta[at.clocks] * problem.clock * samples
        y, by_lag, tangent = _clocked(run, n_y, late)
        by_clock = -by_lag * samples * problem.clock
    else:
        y, by_lag, tangent = _lagged(run, n_y, lags, derivatives and problem.fits_lags)
        by_clock = by_lag
    by_lag = stretch * by_lag
    return SampledReadings(y, tangent, by_lag, by_lag if by_delay is None else by_delay, by_clock)


def sensor_columns(problem: Problem, seen: SampledReadings, rows: Array) -> Array:
    """Return how readings follow each unknown at some samples, shape (n_y, n, n_theta).

    Lags, offsets and clocks of the sensors are filled in, the other columns are zero.
    """
    at, c = slots(problem), np.arange(len(problem.data.names))
    block = np.zeros((c.size, seen.y[rows].shape[0], at.size))
    block[c, :, at.lags.start + c] = seen.by_lag[rows].T
    block[c, :, at.offsets.start + c] = offset_scale(problem)[:, None]
    if problem.clock:
        block[c, :, at.clocks.start + c] = seen.by_clock[rows].T
    return block


def _clocked(run: KernelRun, n_y: int, late: Array) -> tuple[Array, Array, Array]:
    """Read the outputs as sensors with clocks of their own take them, `late` of shape (n, n_y)."""
    y, by_lag, tangent = run.y[:, :n_y].copy(), np.zeros_like(run.y[:, :n_y]), run.dy.copy()
    for c in range(n_y):
        read = np.concatenate([run.y[:, c, None], run.dy[:, c]], axis=1)
        both, slopes = warped(read, late[:, c])
        y[:, c], tangent[:, c], by_lag[:, c] = both[:, 0], both[:, 1:], slopes[:, 0]
    return y, by_lag, tangent[:, :n_y]


def _grown_delays(
    problem: Problem, theta: Array, declared: Array, run: KernelRun, first: int, stretch: float
) -> Array:
    """Delays in samples of each output at each sample of a run, shape (n, n_y)."""
    at, n_y = slots(problem), len(problem.data.names)
    n = (run.y.shape[0] - 1) // problem.steps + 1
    late = np.tile(declared, (n, 1)).reshape(n, n_y)
    passed = problem.data.dt / stretch * np.arange(first, first + n)
    for j, name in enumerate(problem.delays):
        for c in problem.skews.get(name, ()):
            late[:, c] -= stretch * theta[at.delays][j] * passed
    return late


def _declared_delays(
    run: KernelRun, n_y: int, delays: Array, n_sub: int, *, resting: bool
) -> tuple[KernelRun, Array]:
    """Return outputs after the declared delays, on the samples; derivative by the delays.

    `delays` has shape (n_y,), or (n, n_y) where they change along the record.
    """
    n = (run.y.shape[0] - 1) // n_sub + 1
    y, dy = np.empty((n, n_y)), np.empty((n, n_y, run.dy.shape[2]))
    slopes = np.empty((n, n_y))
    for c in range(n_y):
        if delays.ndim == 2 and np.ptp(delays[:, c]):
            late = delays[:, c]
            y[:, c], slopes[:, c] = warped_within(run.y[:, c], late, n_sub, resting=resting)
            dy[:, c] = warped_within(run.dy[:, c], late, n_sub, resting=resting)[0]
            continue
        still = float(delays[..., c].flat[0])
        y[:, c], slopes[:, c] = delayed_within(run.y[:, c], still, n_sub)
        dy[:, c] = delayed_within(run.dy[:, c], still, n_sub)[0]
    return replace(run, y=y, dy=dy, s=run.s[::n_sub], w=run.w[::n_sub]), slopes


def _lagged(run: KernelRun, n_y: int, lags: Array, slopes: bool) -> tuple[Array, Array, Array]:
    """Delay the outputs and their derivatives; with `slopes` also the derivatives by the delay."""
    simulated, tangent = run.y[:, :n_y].copy(), run.dy[:, :n_y]
    shifts = np.zeros_like(simulated)
    if not slopes and not lags.any():
        return simulated, shifts, tangent
    if lags.any():
        tangent = tangent.copy()
    for c in range(n_y):
        if slopes:
            simulated[:, c], shifts[:, c] = delayed(run.y[:, c], lags[c])
        else:
            simulated[:, c] = delayed_values(run.y[:, c], lags[c])
        if lags[c] and tangent.size:
            tangent[:, c] = delayed_values(run.dy[:, c], lags[c])
    return simulated, shifts, tangent


def output_delays(problem: Problem, theta: Array) -> Array:
    """Total delay of each output in samples, shape (n_y,)."""
    at = slots(problem)
    lags = theta[at.lags].copy()
    for j, (name, outputs) in enumerate(problem.delays.items()):
        for c in outputs if name not in problem.skews else ():
            lags[c] += theta[at.delays][j]
    return np.asarray(lags)
