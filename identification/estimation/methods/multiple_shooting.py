"""Multiple shooting: windows with initial states of their own that must join without a gap.

Bock, Springer Series in Chemical Physics 18 (1981) 102. Gauss-Newton on the readings with the
continuity of the states as constraints; each step solves the sparse optimality system, so that
unstable plants do not multiply their growth from window to window.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, final

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from bondgraph.simulation.exact_run import KernelRun
from bondgraph.support.arrays import Array
from bondgraph.support.descent import Damping, Ended, Trial, descend
from bondgraph.support.errors import UnusableInput
from identification.estimation.levenberg_marquardt import STATUS, FitStatus
from identification.estimation.methods.method import FitOptions, FitTask, Method, MethodSolution
from identification.estimation.methods.trajectory import observed, windows_of
from identification.study.free_parameters import dead_times, refuse_clocks
from identification.study.joint import JointPoint, JointProblem
from identification.study.problem import Problem
from identification.study.residual import (
    offset_scale,
    parameters_at,
    read_out,
    sensor_columns,
    slots,
    weighted,
)
from identification.study.study import Study

CLOSED = 1e-7
"""Largest gap between windows, in spreads of the state."""
FREE_RUN_LOSS = 1.02
STAGES = (1.0, 1e2, 1e4, 1e6)
"""Weight of the squared gaps (in spreads of the state) beside the residuals (in noise)."""
STAGE_ITERATIONS = 12


@final
class MultipleShooting(Method):
    """For long, unstable or integrating plants, and for poor start values.

    Memory runs on from window to window with its value; its derivatives end at each window, and the
    free run finishes the fit.
    """

    name: ClassVar[str] = "multiple_shooting"

    def check(self, study: Study) -> None:
        """Refuse windows of the study, dead times and clocks: they reach over edges of windows."""
        if study.window is not None:
            raise UnusableInput(
                f"multiple_shooting joins windows of its own, but window = {study.window} is for "
                "states that need not join; leave window out, or use method='single_shooting'"
            )
        if late := sorted(dead_times(study.graph)):
            raise UnusableInput(
                f"multiple_shooting: {', '.join(late)} is a dead time, which reaches over the "
                "edges of windows; use method='single_shooting'"
            )
        refuse_clocks(study.graph, self.name)

    def solve(self, task: FitTask) -> MethodSolution:
        """Close the gaps, then finish with the free run where it is as good."""
        stack, start, options = task.stack, task.start, task.options
        cut = [windows_of(p) for p in stack.problems]
        whole = replace(stack, problems=tuple(replace(p, window=None) for p in stack.problems))
        begin = _Nodes(start.theta, [observed(whole, start, r, c) for r, c in enumerate(cut)])
        near, approach, cancelled = _approached(whole, cut, begin, options)
        rest = replace(options, max_iterations=0) if cancelled else options
        made, status, trace, system = _descend(whole, cut, near, rest)
        status = FitStatus.CANCELLED if cancelled else status
        trace = (*approach, *trace[1:])
        point = JointPoint(made.theta, tuple(n[:1] for n in made.states))
        now = _swept(whole, cut, made)
        cost = now.cost
        if status is not FitStatus.CANCELLED and np.isfinite(cost):
            free = task.descend(whole, point)
            if np.isfinite(free.cost) and free.cost <= FREE_RUN_LOSS * cost:
                return MethodSolution(free.point, free.status, (*trace, *free.trace[1:]))
        why = "stopped early" if status is FitStatus.CANCELLED else "unstable or integrating"
        notes = (
            f"the free run diverges from the windows ({why}): the readings shown are those of the "
            "joined windows",
        )
        covariance = _information(whole, cut, system)
        return MethodSolution(
            point, status, trace, covariance, notes, now.readings,
            run="windows that join, each with an initial state of its own",
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Unknowns: theta and the state at the start of every window, record by record."""

    theta: Array
    states: list[Array]


@dataclass(frozen=True, eq=False)
class _Sweep:
    """All windows at one point.

    `residual`, `by_theta`, `by_node` for the training readings (scaled nodes), window by window;
    `gap`, `gap_theta`, `gap_node` for the joints.
    """

    cost: float
    gap_size: float
    readings: tuple[Array, ...]
    blocks: list[tuple[int, Array, Array, Array]]
    joints: list[tuple[int, Array, Array, Array]]


def _swept(stack: JointProblem, cut: list[list[slice]], nodes: _Nodes) -> _Sweep:
    total, count, gap_size = 0.0, 0, 0.0
    blocks, joints, readings = [], [], []
    first = 0
    for r, p in enumerate(stack.problems):
        theta = nodes.theta[stack.columns[r]] * stack.factors[r]
        at, dynamics, data = slots(p), p.dynamics, p.data
        slopes = p.slopes(theta)
        ready = dynamics.prepare(parameters_at(p, theta), data.dt, p.n_sub, p.directions, True)
        n_f, n_x, n_y = slopes.size, dynamics.n_x, len(data.names)
        y, dy = np.empty((data.n, n_y)), np.empty((data.n, n_y, n_f))
        local: list[Array] = []
        memory = None
        for k, w in enumerate(cut[r]):
            run = dynamics.run(ready, p.inputs[w], nodes.states[r][k], _fine(p, w), memory=memory)
            memory = run.memory or None
            y[w], dy[w] = run.y[:, :n_y], run.dy[:, :n_y, :n_f]
            local.append(run.dy[:, :n_y, n_f:])
            if k + 1 < len(cut[r]):
                scale = p.state_scale
                gap = (run.x - nodes.states[r][k + 1]) / scale
                wide = np.zeros((n_x, stack.n))
                wide[:, stack.columns[r][at.free]] = run.dx[:, :n_f] * slopes / scale[:, None]
                joints.append((first + k, gap, wide, run.dx[:, n_f:] * scale / scale[:, None]))
                gap_size = max(gap_size, float(np.abs(gap).max(initial=0.0)))
        seen = read_out(
            p, KernelRun(y, dy, y[:, :0], y[:, :0], y[0, :0], {}), theta, derivatives=True
        )
        shown = seen.y + theta[at.offsets] * offset_scale(p)
        readings.append(shown)
        train = data.mask("train")
        rest = weighted(p, (data.readings - shown).T[:, :, None].copy())[:, :, 0]
        block = sensor_columns(p, seen, np.arange(data.n))
        block[:, :, at.free] = seen.tangent.transpose(1, 0, 2) * slopes
        block = weighted(p, block)
        for k, w in enumerate(cut[r]):
            last = k + 1 == len(cut[r])
            rows = np.arange(w.start, w.stop if last else w.stop - 1)
            rows = rows[train[rows]]
            e = rest[:, rows].ravel()
            wide = np.zeros((e.size, stack.n))
            wide[:, stack.columns[r]] = block[:, rows].reshape(e.size, at.size) * stack.factors[r]
            by_node = weighted(p, (local[k] * p.state_scale).transpose(1, 0, 2).copy())
            by_node = by_node[:, rows - w.start].reshape(e.size, n_x)
            blocks.append((first + k, e, wide, by_node))
            total += float(e @ e)
            count += e.size
        first += len(cut[r])
    weight, centre = stack.prior
    with np.errstate(over="ignore", invalid="ignore"):
        total += float(np.sum((weight * (nodes.theta - centre)) ** 2))
    return _Sweep(total / max(count, 1), gap_size, tuple(readings), blocks, joints)


def _fine(p: Problem, w: slice) -> Array:
    """Return the inputs between the samples of a window, cut from those of the whole record."""
    whole = p.fine_inputs(slice(0, p.data.n))
    return np.asarray(whole[w.start * p.n_sub : (w.stop - 1) * p.n_sub])


@dataclass(frozen=True, eq=False)
class _System:
    """Normal matrix and constraints in theta and scaled nodes."""

    gram: sparse.csc_matrix
    right: Array
    joint: sparse.csc_matrix
    gap: Array


def _assembled(
    stack: JointProblem, cut: list[list[slice]], nodes: _Nodes, sweep: _Sweep
) -> _System:
    sizes = [p.dynamics.n_x for p, c in zip(stack.problems, cut, strict=True) for _ in c]
    place = stack.n + np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    total = int(place[-1])
    weight, centre = stack.prior
    gram = sparse.lil_matrix((total, total))
    theta_gram = np.diag(weight**2)
    right = np.zeros(total)
    right[: stack.n] = weight**2 * (centre - nodes.theta)
    for k, e, wide, by_node in sweep.blocks:
        a, b = place[k], place[k + 1]
        theta_gram = theta_gram + wide.T @ wide
        cross = wide.T @ by_node
        gram[: stack.n, a:b] = cross
        gram[a:b, : stack.n] = cross.T
        gram[a:b, a:b] = by_node.T @ by_node
        right[: stack.n] += wide.T @ e
        right[a:b] += by_node.T @ e
    gram[: stack.n, : stack.n] = theta_gram
    rows = sum(j[1].size for j in sweep.joints)
    joint, gap = sparse.lil_matrix((rows, total)), np.zeros(rows)
    at = 0
    for k, g, wide, by_node in sweep.joints:
        n = g.size
        joint[at : at + n, : stack.n] = wide
        joint[at : at + n, place[k] : place[k + 1]] = by_node
        joint[at : at + n, place[k + 1] : place[k + 1] + n] = -np.eye(n)
        gap[at : at + n] = g
        at += n
    return _System(gram.tocsc(), right, joint.tocsc(), gap)


def _held(stack: JointProblem, cut: list[list[slice]], fixed: Array) -> Array:
    """Which unknowns may move: theta off its bounds, nodes except known initial states."""
    free = [~fixed]
    for p, c in zip(stack.problems, cut, strict=True):
        for k in range(len(c)):
            moving = np.ones(p.dynamics.n_x, bool)
            if k == 0:
                moving[:] = False
                moving[p.free_states] = True
            free.append(moving)
    return np.concatenate(free)


def _stepped(
    stack: JointProblem, cut: list[list[slice]], nodes: _Nodes, system: _System, damping: float
) -> tuple[Array, Array] | None:
    """Step and multipliers of the damped optimality system, within the bounds."""
    lower, upper = stack.bounds
    low = np.maximum(lower - nodes.theta, -stack.lowest)
    high = np.maximum(np.minimum(upper - nodes.theta, stack.lowest), low)
    clipped = np.zeros(stack.n)
    fixed = high <= low
    total = system.gram.shape[0]
    size = system.gram.diagonal()
    for _ in range(stack.n + 1):
        free = _held(stack, cut, fixed)
        delta = np.zeros(total)
        delta[: stack.n] = np.where(fixed, clipped, 0.0)
        h = system.gram + sparse.diags(damping * size + 1e-14 * size.max())
        right = (system.right - system.gram @ delta)[free]
        gap = -(system.gap + system.joint @ delta)
        joint = system.joint[:, free]
        matrix = sparse.bmat([[h[free][:, free], joint.T], [joint, None]], format="csc")
        try:
            solved = splu(matrix).solve(np.concatenate([right, gap]))
        except RuntimeError:
            return None
        if not np.isfinite(solved).all():
            return None
        n_free = int(free.sum())
        delta[free] = solved[:n_free]
        over = (delta[: stack.n] < low - 1e-12) | (delta[: stack.n] > high + 1e-12)
        if not (over & ~fixed).any():
            return delta, solved[n_free:]
        clipped = np.where(over & ~fixed, np.clip(delta[: stack.n], low, high), clipped)
        fixed = fixed | over
    return None


def _moved(stack: JointProblem, cut: list[list[slice]], nodes: _Nodes, delta: Array) -> _Nodes:
    at, states = stack.n, []
    for p, c, old in zip(stack.problems, cut, nodes.states, strict=True):
        n = p.dynamics.n_x * len(c)
        states.append(old + delta[at : at + n].reshape(len(c), -1) * p.state_scale)
        at += n
    return _Nodes(nodes.theta + delta[: stack.n], states)


@dataclass(frozen=True, eq=False)
class _Stand:
    """Where a descent stands: nodes, their sweep, what is lowered, its last relative gain."""

    nodes: _Nodes
    sweep: _Sweep
    cost: float
    gain: float = 1.0


DRAWN = Damping(most=1e8)
JOINED = Damping(least=1e-12, most=1e10)


def _approached(
    stack: JointProblem, cut: list[list[slice]], nodes: _Nodes, options: FitOptions
) -> tuple[_Nodes, list[float], bool]:
    """Draw the windows together: gaps cost more from stage to stage.

    With loose windows the misfit has no wrong minima that come from many periods; the constraints
    alone would close the gaps before the parameters are near. Returns where the stages lead, the
    costs on the way, and whether Ctrl-C ended them.
    """
    trace: list[float] = []

    def taken(at: _Stand) -> None:
        nonlocal nodes
        nodes = at.nodes
        trace.append(at.sweep.cost)
        if options.report is not None and len(trace) > 1:
            options.report(len(trace) - 1, at.sweep.cost)

    try:
        at = _Stand(nodes, sweep := _swept(stack, cut, nodes), sweep.cost)
        taken(at)
        for weight in STAGES if np.isfinite(at.cost) else ():
            at = descend(
                replace(at, cost=_soft(at.sweep, weight)),
                partial(_loose_steps, stack, cut, weight),
                DRAWN, STAGE_ITERATIONS,
                lambda old, new: old.cost - new.cost < 1e-2 * max(old.cost, 1e-300),
                taken=taken,
            ).at  # fmt: skip
    except KeyboardInterrupt:
        return nodes, trace or [np.inf], True
    return nodes, trace, False


def _soft(sweep: _Sweep, weight: float) -> float:
    count = max(sum(e.size for _, e, _, _ in sweep.blocks), 1)
    gaps = sum(float(g @ g) for _, g, _, _ in sweep.joints)
    return sweep.cost * count + weight * gaps


def _loose_steps(
    stack: JointProblem, cut: list[list[slice]], weight: float, at: _Stand
) -> Trial[_Stand]:
    """Linearise with gaps of a weight; what makes the damped steps from there."""
    system = _assembled(stack, cut, at.nodes, at.sweep)
    gram = system.gram + weight * (system.joint.T @ system.joint)
    right = system.right - weight * (system.joint.T @ system.gap)
    lower, upper = stack.bounds
    free = _held(stack, cut, upper <= lower)
    size = gram.diagonal()

    def trial(damping: float, number: int) -> _Stand:
        h = (gram + sparse.diags(damping * size + 1e-14 * size.max())).tocsc()
        delta = np.zeros(size.size)
        delta[free] = splu(h[free][:, free].tocsc()).solve(right[free])
        delta[: stack.n] = np.clip(delta[: stack.n], -stack.lowest, stack.lowest)
        moved = _moved(stack, cut, at.nodes, delta)
        moved = replace(moved, theta=np.clip(moved.theta, lower, upper))
        sweep = _swept(stack, cut, moved)
        return _Stand(moved, sweep, _soft(sweep, weight))

    return trial


def _descend(
    stack: JointProblem, cut: list[list[slice]], nodes: _Nodes, options: FitOptions
) -> tuple[_Nodes, FitStatus, tuple[float, ...], _System]:
    begun = _Stand(nodes, sweep := _swept(stack, cut, nodes), 0.0)
    trace, penalty = [sweep.cost], 0.0
    if not np.isfinite(sweep.cost):
        return nodes, FitStatus.BROKEN, (np.inf,), _assembled(stack, cut, nodes, sweep)
    count = max(sum(e.size for _, e, _, _ in sweep.blocks), 1)

    def merit(sweep: _Sweep) -> float:
        gaps = sum(float(np.abs(g).sum()) for _, g, _, _ in sweep.joints)
        return sweep.cost * count + penalty * gaps

    def steps_from(at: _Stand) -> Trial[_Stand]:
        system = _assembled(stack, cut, at.nodes, at.sweep)

        def trial(damping: float, number: int) -> _Stand | None:
            nonlocal penalty
            found = _stepped(stack, cut, at.nodes, system, damping)
            if found is None:
                return None
            delta, multipliers = found
            penalty = max(penalty, 2.0 * float(np.abs(multipliers).max(initial=0.0)))
            moved = _moved(stack, cut, at.nodes, delta)
            sweep, old = _swept(stack, cut, moved), merit(at.sweep)
            # a penalty that rises changes what is lowered: only the change of each step counts
            change = merit(sweep) - old
            gain = -change / max(old, 1e-300)
            return _Stand(moved, sweep, at.cost + change - 1e-12 * old, gain)

        return trial

    def taken(at: _Stand) -> None:
        trace.append(at.sweep.cost)
        if options.report is not None:
            options.report(len(trace) - 1, at.sweep.cost)

    def settled(at: _Stand, tolerance: float) -> bool:
        return at.gain < tolerance and at.sweep.gap_size < CLOSED

    made = descend(
        begun, steps_from, JOINED, options.max_iterations,
        lambda old, new: settled(new, options.tolerance), taken=taken, kept=True,
    )  # fmt: skip
    best = made.at
    near = made.ended is Ended.STUCK and settled(best, 100 * options.tolerance)
    status = FitStatus.CONVERGED if near else STATUS[made.ended]
    return best.nodes, status, tuple(trace), _assembled(stack, cut, best.nodes, best.sweep)


def _information(stack: JointProblem, cut: list[list[slice]], system: _System) -> Array:
    """Covariance of theta under the constraints: a block of the inverse optimality system."""
    n, (lower, upper) = stack.n, stack.bounds
    free = _held(stack, cut, upper <= lower)
    size = system.gram.diagonal()[free]
    h = system.gram[free][:, free] + sparse.diags(np.full(size.size, 1e-14 * size.max()))
    joint = system.joint[:, free]
    matrix = sparse.bmat([[h, joint.T], [joint, None]], format="csc")
    at = np.flatnonzero(free[:n])
    unit = np.eye(matrix.shape[0], at.size)
    found = np.zeros((n, n))
    try:
        found[np.ix_(at, at)] = splu(matrix).solve(unit)[: at.size]
    except RuntimeError:
        return np.full((n, n), np.nan)
    return found
