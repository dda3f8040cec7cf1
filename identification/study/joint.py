"""Several records under one vector of unknowns: what is shared once, the rest record by record.

Global unknowns are the free parameters and declared delays, shared by the records unless they are
named as `own`, and each record's lags, offsets and clock ratios. The residuals of the records add
up; the initial states stay eliminated record by record.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.descent import bounded_step
from bondgraph.support.tall import triangle
from identification.study.problem import Problem
from identification.study.residual import (
    Point,
    ResidualEvaluation,
    evaluate,
    slots,
    start_point,
    windows,
)
from identification.study.scaled import Free

NUISANCE_LAG = 0.25
# a quarter of a sample: filters and multiplexers; more is a finding
LARGEST_RATIO = 0.1
"""Ratio error of a clock that declares no bounds: beyond it nobody speaks of one rate."""
LARGEST_STEP = 1.5
STATE_WEIGHT = 0.1
"""One over the standard deviation of a free initial state, in spreads of that state."""


@dataclass(frozen=True)
class JointPoint:
    """Where the fit of a stack stands.

    Attributes
    ----------
    theta : ndarray, shape (n,)
        Global unknowns.
    states : tuple of ndarray, shape (n_windows, n_x) each
        Initial states, record by record.
    """

    theta: Array
    states: tuple[Array, ...]


@dataclass(frozen=True)
class NormalEquations:
    """Compressed least squares: triangular factor of [J r] and how states follow theta."""

    factor: Array
    right: Array
    states: tuple[list[tuple[Array, Array]], ...]


@dataclass(frozen=True, eq=False)
class JointProblem:
    """Problems with one vector of unknowns.

    Attributes
    ----------
    problems : tuple of Problem
        One a record.
    names : tuple of str
        Labels of the global unknowns.
    columns : tuple of ndarray of int
        Global position of each local unknown, record by record.
    factors : tuple of ndarray
        ``local = factor * global``: delays count in samples of their own record.
    held : dict of int to float
        Unknowns and the theta they are held at.
    loosened : dict of int to float
        Factors on the weights of priors, see `loose`.
    """

    problems: tuple[Problem, ...]
    names: tuple[str, ...]
    columns: tuple[Array, ...]
    factors: tuple[Array, ...]
    held: Mapping[int, float] = field(default_factory=dict)
    loosened: Mapping[int, float] = field(default_factory=dict)

    @property
    def n(self) -> int:
        """Number of global unknowns."""
        return len(self.names)

    @cached_property
    def free(self) -> dict[int, Free]:
        """Free parameters of all records by their position among the unknowns."""
        found: dict[int, Free] = {}
        for p, at in zip(self.problems, self.columns, strict=True):
            for f, i in zip(p.free, at, strict=False):
                found.setdefault(int(i), f)
        return found

    @cached_property
    def of_model(self) -> dict[int, Free]:
        """Those of `free` that the model has without what the measuring chain adds."""
        added = {n for p in self.problems for n in p.added}
        return {i: f for i, f in self.free.items() if f.parameter.name not in added}

    def local(self, point: JointPoint, record: int) -> Point:
        """Unknowns of one record."""
        theta = point.theta[self.columns[record]] * self.factors[record]
        return Point(theta, point.states[record])

    def gathered(self, points: Sequence[Point]) -> JointPoint:
        """Global unknowns from those of every record; the first record that has one counts."""
        theta = np.zeros(self.n)
        for point, at, factor in reversed(
            list(zip(points, self.columns, self.factors, strict=True))
        ):
            theta[at] = point.theta / factor
        return JointPoint(theta, tuple(p.states for p in points))

    def start(self) -> JointPoint:
        """Start values of every record."""
        return self.gathered([start_point(p) for p in self.problems])

    def evaluate(
        self,
        point: JointPoint,
        *,
        derivatives: bool = True,
        scored: bool = False,
        limit: float = np.inf,
    ) -> tuple[ResidualEvaluation, ...]:
        """Simulate every record, or of each what is scored up to a limit; see `evaluate` of one."""
        return tuple(
            evaluate(p, self.local(point, r), derivatives=derivatives, scored=scored, limit=limit)
            for r, p in enumerate(self.problems)
        )

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the unknowns; those of a held one coincide."""
        lower, upper = np.full(self.n, -np.inf), np.full(self.n, np.inf)
        for p, at, factor in zip(self.problems, self.columns, self.factors, strict=True):
            low, high = _bounds(p)
            lower[at] = np.maximum(lower[at], low / factor)
            upper[at] = np.minimum(upper[at], high / factor)
        for i, theta in self.held.items():
            lower[i] = upper[i] = theta
        return lower, upper

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Weights (one over a standard deviation) and centres of the priors on theta."""
        weight, centre = np.zeros(self.n), np.zeros(self.n)
        for p, at, factor in zip(self.problems, self.columns, self.factors, strict=True):
            local_weight, local_centre = _prior(p)
            weight[at] = local_weight * factor
            centre[at] = local_centre / factor
        for i, part in self.loosened.items():
            weight[i] *= part
        return weight, centre

    def loose(self, point: JointPoint) -> JointProblem:
        """Return the problem with weak priors that hold a small value as they hold a declared one.

        A factor of twenty about a millionth of what was declared is nearly nothing: it would pin a
        damper that has vanished, and with it what another one gives in its place. For intervals.
        """
        given = {n for p in self.problems for n in p.scaled_priors}
        small: dict[int, float] = {}
        for i, f in self.free.items():
            declared = f.parameter.value
            if f.log and declared > 0 and f.parameter.name not in given:
                part = f.value(float(point.theta[i])) / declared
                small |= {i: part} if part < 1 else {}
        return replace(self, loosened=small) if small else self

    @property
    def lowest(self) -> Array:
        """Largest change of a logarithmic unknown in one step; others are free."""
        limit = np.full(self.n, np.inf)
        limit[[i for i, f in self.free.items() if f.log]] = LARGEST_STEP
        return limit

    def scored(self, record: int) -> list[int]:
        """Return the windows of a record that have training samples."""
        return _scored(self.problems[record])

    def count(self, evaluations: Sequence[ResidualEvaluation]) -> int:
        """Return the number of residuals."""
        return max(sum(e.residual.size for e in evaluations), 1)

    def channels(self, evaluations: Sequence[ResidualEvaluation]) -> tuple[int, ...]:
        """Return the residuals of each reading of each window of each record, in order."""
        return tuple(
            (rows.stop - rows.start) // len(p.data.names)
            for p, e in zip(self.problems, evaluations, strict=True)
            for rows, _ in e.local
            for _ in p.data.names
        )

    def readings(self, evaluations: Sequence[ResidualEvaluation]) -> tuple[int, ...]:
        """Return how many of `channels` are the readings of each window."""
        pairs = zip(self.problems, evaluations, strict=True)
        return tuple(len(p.data.names) for p, e in pairs for _ in e.local)

    def cost(self, evaluations: Sequence[ResidualEvaluation], point: JointPoint) -> float:
        """Mean square of residuals and priors."""
        weight, centre = self.prior
        with np.errstate(over="ignore", invalid="ignore"):
            total = float(np.sum((weight * (point.theta - centre)) ** 2))
            for p, e, states in zip(self.problems, evaluations, point.states, strict=True):
                total += float(e.residual @ e.residual)
                if p.window is None and p.free_states.size:
                    away = STATE_WEIGHT * (states - p.rest_state) / p.state_scale
                    total += float(np.sum(away[:, p.free_states] ** 2))
        return total / self.count(evaluations)

    def normal(
        self, evaluations: Sequence[ResidualEvaluation], point: JointPoint
    ) -> NormalEquations:
        """Compress the residuals of all records and the priors into one triangle."""
        weight, centre = self.prior
        pieces = [np.hstack([np.diag(weight), (weight * (centre - point.theta))[:, None]])]
        states = []
        for r, (p, e) in enumerate(zip(self.problems, evaluations, strict=True)):
            body, followed = _eliminated(p, e, point.states[r])
            wide = np.zeros((body.shape[0], self.n + 1))
            wide[:, self.columns[r]] = body[:, :-1] * self.factors[r]
            wide[:, -1] = body[:, -1]
            pieces.append(wide)
            states.append(followed)
        stacked = np.vstack(pieces)
        if not np.isfinite(stacked).all():
            return NormalEquations(stacked[: self.n, : self.n] * np.nan, stacked[: self.n, -1], ())
        compressed = triangle(stacked)
        return NormalEquations(compressed[:, : self.n], compressed[:, self.n], tuple(states))

    def step(
        self, system: NormalEquations, point: JointPoint, damping: float, settling: float = 1.0
    ) -> JointPoint:
        """Damped Gauss-Newton step within the bounds; `settling` as `followed` has it."""
        size = np.linalg.norm(system.factor, axis=0) + 1e-12
        if not np.isfinite(size).all() or not np.isfinite(system.right).all():
            return JointPoint(point.theta * np.nan, point.states)
        lower, upper = self.bounds
        low = np.maximum(lower - point.theta, -self.lowest)
        high = np.maximum(np.minimum(upper - point.theta, self.lowest), low)
        a = np.vstack([system.factor, np.sqrt(damping) * np.diag(size)])
        b = np.concatenate([system.right, np.zeros(size.size)])
        delta = bounded_step(a, b, low, high)
        return JointPoint(point.theta + delta, self.followed(system, point, delta, settling))

    def followed(
        self, system: NormalEquations, point: JointPoint, delta: Array, settling: float = 1.0
    ) -> tuple[Array, ...]:
        """Return the initial states after a step of theta, to first order.

        Parameters
        ----------
        delta : ndarray, shape (n,)
        settling : float
            Part of what the residual asks of them that is taken up, beside what the step does.
        """
        states = []
        for r, p in enumerate(self.problems):
            moved = point.states[r].copy()
            by_local = delta[self.columns[r]] * self.factors[r]
            at = p.free_states
            if at.size:
                scale = p.state_scale[at]
                for i, (by_theta, by_residual) in zip(_scored(p), system.states[r], strict=True):
                    moved[i, at] += (settling * by_residual - by_theta @ by_local) * scale
            states.append(moved)
        return tuple(states)

    def projected(self, evaluations: Sequence[ResidualEvaluation], point: JointPoint) -> Array:
        """Jacobian of all residuals by theta with the initial states eliminated, (M, n)."""
        pieces = []
        for r, (p, e) in enumerate(zip(self.problems, evaluations, strict=True)):
            jacobian = e.jacobian.copy()
            at = p.free_states
            if at.size:
                _, states = _eliminated(p, e, point.states[r])
                for (rows, local), (by_theta, _) in zip(e.local, states, strict=True):
                    jacobian[rows] -= (local * p.state_scale[at]) @ by_theta
            wide = np.zeros((jacobian.shape[0], self.n))
            wide[:, self.columns[r]] = jacobian * self.factors[r]
            pieces.append(wide)
        return np.concatenate(pieces)


def stack_of(
    problems: Sequence[Problem], own: Collection[str] = (), labels: Sequence[str] = ()
) -> JointProblem:
    """Join `problems`; parameters named in `own` take a value in every record.

    `labels` name the records in the labels of the unknowns; numbers from 1 if left out.
    """
    labels = labels or [str(r + 1) for r in range(len(problems))]
    keys: dict[tuple[object, ...], int] = {}
    columns, factors = [], []
    first = problems[0].data.dt
    for r, p in enumerate(problems):
        at: list[int] = []
        factor = np.ones(slots(p).size)
        for key in _keys(p, r, own):
            at.append(keys.setdefault(key, len(keys)))
        factor[slots(p).delays] = first / p.data.dt
        columns.append(np.array(at, int))
        factors.append(factor)
    names = []
    for key in keys:
        whose = f" @{labels[int(str(key[2]))]}" if len(problems) > 1 and len(key) > 2 else ""
        names.append(f"{key[1]}{whose}")
    return JointProblem(tuple(problems), tuple(names), tuple(columns), tuple(factors))


def _keys(p: Problem, r: int, own: Collection[str]) -> list[tuple[object, ...]]:
    """Return what each local unknown is, in the order of `slots`."""

    def shared(name: str) -> tuple[object, ...]:
        return ("value", name, r) if name in own else ("value", name)

    found: list[tuple[object, ...]] = [shared(f.parameter.name) for f in p.free]
    found += [("lag", f"delay {n}", r) for n in p.data.names]
    found += [shared(n) for n in p.delays]
    found += [("offset", f"offset {n}", r) for n in p.data.names]
    found += [("clock", f"clock {n}", r) for n in p.data.names if p.clock]
    return found


def _bounds(problem: Problem) -> tuple[Array, Array]:
    at = slots(problem)
    lower, upper = np.full(at.size, -np.inf), np.full(at.size, np.inf)
    for i, f in enumerate(problem.free):
        lower[i], upper[i] = f.bounds()
    lag = NUISANCE_LAG if problem.fits_lags else 0.0
    lower[at.lags], upper[at.lags] = -lag, lag
    if problem.data.reads_after:  # what has jumped at its sample is not late by a part of one
        jumping = at.lags.start + np.flatnonzero(problem.passing)
        lower[jumping] = upper[jumping] = 0.0
    for name, outputs in problem.delays.items():
        if name not in problem.skews:
            for c in outputs:  # a declared dead time takes the place of the nuisance
                lower[at.lags.start + c] = upper[at.lags.start + c] = 0.0
    for j, name in enumerate(problem.delays):
        lower[at.delays.start + j], upper[at.delays.start + j] = _dead_time(problem, name)
    if not (problem.offsets and (problem.window is None or problem.window_offsets)):
        lower[at.offsets] = upper[at.offsets] = 0.0
    for c in _own_offsets(problem):  # a declared one that is free takes the place of the nuisance
        lower[at.offsets.start + c] = upper[at.offsets.start + c] = 0.0
    lower[at.clocks], upper[at.clocks] = -1.0, 1.0
    return lower, upper


def _own_offsets(problem: Problem) -> list[int]:
    """Positions of the readings whose declared offset is fitted."""
    free = {f.parameter.name for f in problem.free}
    held = [problem.graph.channel_value(problem.graph[n], "offset") for n in problem.data.names]
    return [
        c for c, v in enumerate(held) if v is not None and free & {str(s) for s in v.free_symbols}
    ]


def _dead_time(problem: Problem, name: str) -> tuple[float, float]:
    """Bounds of a declared dead time or clock, over the time between samples; one if held."""
    dt, skewed = problem.data.dt, name in problem.skews
    p = problem.late[name]
    if name in problem.fixed or (p is not None and p.fixed):
        known = problem.late_starts[name] / dt
        return known, known
    longest = LARGEST_RATIO / dt if skewed else 0.1 * problem.data.n
    low = (-longest if skewed else 0.0) if p is None or p.lower is None else p.lower / dt
    if not skewed:
        low = max(low, 0.0)
    high = longest if p is None or p.upper is None else p.upper / dt
    return low, max(high, low)


def _prior(problem: Problem) -> tuple[Array, Array]:
    at, known = slots(problem), problem.scaled_priors
    weight, centre = np.zeros(at.size), np.zeros(at.size)
    weight[at.free] = [1.0 / 3.0 if f.log else 0.1 for f in problem.free]
    for i, f in enumerate(problem.free):
        if f.parameter.name in known:
            centre[i], weight[i] = known[f.parameter.name]
    weight[at.lags] = 1.0
    weight[at.delays] = 1e-3
    for j, name in enumerate(problem.delays, start=at.delays.start):
        if name in known:
            centre[j], weight[j] = known[name]
    weight[at.offsets] = 0.1
    weight[at.clocks] = 1.0
    return weight, centre


def _scored(problem: Problem) -> list[int]:
    train = problem.data.mask("train")
    return [i for i, w in enumerate(windows(problem)) if train[w].any()]


def _eliminated(
    problem: Problem, e: ResidualEvaluation, states: Array
) -> tuple[Array, list[tuple[Array, Array]]]:
    """Return rows [J r] without the initial states, and how these follow; windows one by one.

    The rows are compressed: those of a window's triangle that its states leave.
    """
    free = problem.free_states
    if not free.size:
        return np.hstack([e.jacobian, e.residual[:, None]]), []
    k, n = free.size, e.jacobian.shape[1]
    scale = problem.state_scale[free]
    pull = 0.0 if problem.window is not None else -STATE_WEIGHT
    away = pull * (states[:, free] - problem.rest_state[free]) / scale
    pieces: list[Array] = [np.zeros((0, n + 1))] * len(e.local)
    followed = [(np.zeros((k, n)), np.zeros(k))] * len(e.local)
    alike: dict[int, list[int]] = {}
    for number, (_, local) in enumerate(e.local):
        alike.setdefault(local.shape[0], []).append(number)
    scored = np.array(_scored(problem), int)
    for size, numbers in alike.items():  # windows of one length in one call
        whole = np.zeros((len(numbers), size + k, k + n + 1))
        whole[:, -k:, :k] = STATE_WEIGHT * np.eye(k)
        whole[:, -k:, -1] = away[scored[numbers]]
        for stacked, number in zip(whole, numbers, strict=True):
            rows, local = e.local[number]
            stacked[:-k, :k], stacked[:-k, k:-1] = local * scale, e.jacobian[rows]
            stacked[:-k, -1] = e.residual[rows]
        r = triangle(whole)
        follow = np.linalg.solve(r[:, :k, :k], r[:, :k, k:])
        for number, own, tail in zip(numbers, follow, r[:, k:, k:], strict=True):
            pieces[number], followed[number] = tail, (own[:, :n], own[:, n])
    return np.concatenate(pieces), followed


LITTLE, ROUNDING = 1e-4, 1e-12
"""Parts of a window's misfit: gained at most by the last step, and promised by none but rounding.

At a kink a step gains more than the derivatives promise, so that a small promise ends nothing."""


def refine_states(problem: Problem, point: Point, passes: int = 12) -> Point:
    """Improve the initial states of the training windows, parameters kept.

    Damped Gauss-Newton, window by window: a window keeps its state unless its own misfit falls,
    so that one window at a kink (sticking friction) does not hold up the others. Only windows that
    have something to gain are simulated again.
    """
    states, scale = point.states.copy(), problem.state_scale
    free = problem.free_states
    scored = _scored(problem)
    damping = np.full(len(scored), 1e-6)
    begun = evaluate(problem, point, by_parameters=False, scored=True)
    residual, columns = begun.residual.copy(), list(begun.local)
    for _ in range(passes):
        trial, moving = states.copy(), list[int]()
        for k, (i, (rows, local)) in enumerate(zip(scored, columns, strict=True)):
            a, r = local * scale[free], residual[rows]
            size = np.sqrt(damping[k]) * np.diag(np.linalg.norm(a, axis=0) + 1e-9)
            right = np.concatenate([r, np.zeros(free.size)])
            if not (np.isfinite(size).all() and np.isfinite(right).all()):
                continue  # a run that ran away says nothing; LAPACK would print it
            moved = np.linalg.lstsq(np.vstack([a, size]), right, rcond=1e-12)[0]
            left = r - a @ moved
            if float(left @ left) < (1.0 - ROUNDING) * float(r @ r):
                trial[i, free] += moved * scale[free]
                moving.append(k)
        if not moving:
            break
        among = {scored[k] for k in moving}
        after = evaluate(
            problem, Point(point.theta, trial), by_parameters=False, scored=True, among=among
        )
        gain = 0.0
        for k, (there, local) in zip(moving, after.local, strict=True):
            i, rows = scored[k], columns[k][0]
            old = float(residual[rows] @ residual[rows])
            new = float(after.residual[there] @ after.residual[there])
            if np.isfinite(new) and new <= old:
                states[i], residual[rows] = trial[i], after.residual[there]
                columns[k] = (rows, local)
                damping[k] = max(damping[k] / 10, 1e-12)
                gain = max(gain, (old - new) / max(old, 1e-300))
            else:
                damping[k] = min(damping[k] * 100, 1e6)
                gain = 1.0
        if gain < LITTLE:
            break
    return Point(point.theta, states)


def held_out_states(problem: Problem, point: Point) -> Point:
    """Fit initial states of the held-out windows, as an observer would; parameters kept.

    A window that trains as well, a recording divided by the user, keeps the state it was fitted
    with.
    """
    data = problem.data
    swapped = replace(data.split, train=data.split.test, test=data.split.train)
    turned = replace(
        problem, data=replace(data, split=swapped), known_scale=problem.state_scale,
        built=problem.dynamics,
    )  # fmt: skip
    states = refine_states(turned, point).states
    kept = _scored(problem)
    states[kept] = point.states[kept]
    return Point(point.theta, states)
