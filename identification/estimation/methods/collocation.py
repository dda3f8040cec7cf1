"""Direct collocation: states at every sample are unknowns, the equations are constraints.

Radau IIA of order 5 (three stages, L-stable), the sparse programme solved by IPOPT with exact
derivatives; Biegler, Nonlinear Programming (SIAM 2010), ch. 10. What the steps leave out is found
by steps four times shorter and allowed to the constraints (defect correction, Stetter, Numer. Math.
29 (1978) 425), so that the solution is that of the differential equations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, final

import casadi as ca
import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from bondgraph.errors import UnusableInput
from identification.engine import Engine
from identification.estimation.methods.method import Method, Options, Solution
from identification.estimation.methods.multiple_shooting import _observed, _windows
from identification.estimation.methods.radau import march
from identification.estimation.methods.transcription import (
    STAGES,
    Programme,
    Record,
    followed,
    programme,
    record_of,
    rescaled,
    scales_along,
)
from identification.estimation.study import Setting, Study
from identification.levenberg_marquardt import Status
from identification.residual import slots
from identification.stack import Stack, Stacked

__all__ = ["Collocation"]

Array = np.ndarray
LARGE = 1e19
FINER = 4
MOST_STEPS = 16
"""Largest number of steps a sample."""
COARSE = 0.3
"""Steps are halved while their error moves an unknown by more of its standard error than this."""
LOOSE = 30.0
"""The same while noise is not known yet."""
CLOSE = 3e-4
"""Defects are corrected until none moves by more of its standard error than this."""
CORRECTIONS = 6
ROUGH = 1e-5
"""Tolerance above which a fit is a step on the way: its defects are not corrected."""
FREE_RUN_LOSS = 1.02
FINE_RUNS = (1, 4, 16)
FEASIBLE = 1e-6
EDGE = 1e-9
"""Distance from a bound at which an unknown counts as held."""


@final
@dataclass(frozen=True)
class Collocation(Method):
    """For unstable and integrating plants of moderate length.

    Attributes
    ----------
    hessian : {"exact", "gauss_newton"}
        Of the Lagrangian; the second leaves out the curvature of the constraints.
    wall_time : float
        Longest time of one run of IPOPT, s.
    """

    hessian: str = "exact"
    wall_time: float = 600.0

    name: ClassVar[str] = "collocation"
    memory: ClassVar[str] = "refused: what the memory keeps would need equations of its own"
    optimisers: ClassVar[tuple[str, ...]] = ("ipopt",)

    def check(self, study: Study) -> None:
        """Refuse memory, jumps, dead times, clocks and windows."""
        instead = "use method='single_shooting'"
        for e in study.graph.elements.values():
            law, drive = getattr(e, "law", None), getattr(e, "drive", None)
            if law is not None and law.n_memory:
                raise UnusableInput(f"collocation: the law of {e.name} has memory; {instead}")
            if law is not None and law.set_valued:
                raise UnusableInput(f"collocation: the law of {e.name} jumps; {instead}")
            if getattr(e, "delay", None) or (drive is not None and drive.delay):
                raise UnusableInput(f"collocation: {e.name} has a dead time; {instead}")
        if study.nuisances.clock:
            raise UnusableInput(f"collocation fits no clocks of the sensors; {instead}")
        if study.window is not None:
            raise UnusableInput("collocation has no use for windows: leave window out")

    def solve(
        self, study: Study, setting: Setting, stack: Stack, start: Stacked, options: Options
    ) -> Solution:
        """Solve, halve the steps while they are coarse, then correct what they leave out."""
        lower, upper = stack.bounds
        start = replace(start, theta=np.clip(start.theta, lower, upper))
        n_sub, records, w = 1, *_begin(stack, start, 1)
        trace: list[float] = []
        coarse = COARSE if options.tolerance <= ROUGH else LOOSE
        while True:
            made = programme(stack, records, w[: stack.n])
            runner = _Runner(self, made, options, trace)
            allowed = [np.zeros((r.step.n_x, r.steps)) for r in records]
            found = runner.run(w, allowed)
            system = _system(runner, found)
            shift, defects = _shift(runner, found, system)
            if not (found.done and shift > coarse and n_sub < MOST_STEPS):
                break
            n_sub *= 2
            records, w = _finer(stack, made, records, found.w, n_sub)
        for _ in range(CORRECTIONS):
            if options.tolerance > ROUGH or not CLOSE < shift < np.inf:
                break
            allowed = [a + d for a, d in zip(allowed, defects, strict=True)]
            better = runner.run(found.w, allowed, found)
            if not better.done:
                break
            found, before = better, shift
            shift, defects = _shift(runner, found, system)
            if shift > 0.7 * before:
                break
        return _solution(made, runner, found, shift, trace)


@dataclass(frozen=True, eq=False)
class _Found:
    """Unknowns and multipliers where IPOPT ended, with the parameters of that programme."""

    w: Array
    p: Array
    multipliers: Array
    bounds: Array
    status: Status
    cost: float

    @property
    def done(self) -> bool:
        return self.status is Status.CONVERGED


class _Runner:
    """IPOPT for one programme."""

    def __init__(
        self, method: Collocation, made: Programme, options: Options, trace: list[float]
    ) -> None:
        self.made, self.options, self.trace = made, options, trace
        self.problem = {"x": made.w, "p": made.p, "f": made.f, "g": made.g}
        self.watch = _Watch(self, made.w.numel(), made.g.numel(), made.p.numel())
        lower, upper = made.stack.bounds
        free = np.full(made.w.numel() - made.stack.n, LARGE)
        self.lower = np.concatenate([np.maximum(lower, -LARGE), -free])
        self.upper = np.concatenate([np.minimum(upper, LARGE), free])
        self.hold()
        settings: dict[str, Any] = {
            "ipopt.linear_solver": options.linear_solver,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "print_time": False,
            "ipopt.max_iter": max(options.max_iterations, 1),
            "ipopt.max_wall_time": method.wall_time,
            "ipopt.tol": min(options.tolerance, 1e-8),
            "ipopt.bound_relax_factor": 0.0,
            "ipopt.fixed_variable_treatment": "make_parameter",
            "iteration_callback": self.watch,
            "error_on_fail": False,
        }
        if method.hessian == "gauss_newton":
            settings["hess_lag"] = self._squares()
        self.first = ca.nlpsol("collocation", "ipopt", self.problem, settings)
        settings["jac_g"] = self.first.get_function("nlp_jac_g")
        settings["hess_lag"] = self.first.get_function("nlp_hess_l")
        again = settings | {"ipopt.warm_start_init_point": "yes", "ipopt.mu_init": 1e-7}
        self.again = ca.nlpsol("collocation_again", "ipopt", self.problem, again)

    def _squares(self) -> ca.Function:
        made = self.made
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", made.g.numel())
        slope = ca.jacobian(made.residual, made.w)
        whole = ca.triu(lam_f / made.count * (slope.T @ slope))
        return ca.Function("squares", [made.w, made.p, lam_f, lam_g], [whole])

    def hold(self) -> None:
        """Fix the known initial states by their bounds; `run` fills in the values."""
        at, self.known = self.made.stack.n, []
        for record in self.made.records:
            problem = record.problem
            if problem.initial != "rest":
                for i in range(record.step.n_x):
                    if record.order[i] not in problem.free_states:
                        self.known.append(at + i)
            at += record.size * (1 + STAGES * record.steps)

    def run(self, w: Array, allowed: list[Array], last: _Found | None = None) -> _Found:
        made = self.made
        p = made.parameters(allowed, w[: made.stack.n])
        self.lower[self.known] = self.upper[self.known] = w[self.known]
        self.watch.best, self.watch.interrupted = None, False
        solver, extra = self.first, {}
        if last is not None:
            solver, extra = self.again, {"lam_g0": last.multipliers, "lam_x0": last.bounds}
        try:
            out = solver(x0=w, p=p, lbx=self.lower, ubx=self.upper, lbg=0.0, ubg=0.0, **extra)
        except (KeyboardInterrupt, RuntimeError):
            if not self.watch.interrupted and self.watch.best is None:
                raise
            return self._kept(w, p, Status.CANCELLED)
        said = solver.stats()["return_status"]
        found, multipliers = out["x"].full().ravel(), out["lam_g"].full().ravel()
        cost = 2.0 * float(out["f"])
        if self.watch.interrupted or said == "User_Requested_Stop":
            return self._kept(w, p, Status.CANCELLED)
        status = {
            "Solve_Succeeded": Status.CONVERGED,
            "Solved_To_Acceptable_Level": Status.CONVERGED,
            "Maximum_Iterations_Exceeded": Status.ITERATIONS,
            "Maximum_WallTime_Exceeded": Status.ITERATIONS,
        }.get(said, Status.NO_PROGRESS)
        if status is not Status.CONVERGED:
            return self._kept(found, p, status)
        return _Found(found, p, multipliers, out["lam_x"].full().ravel(), status, cost)

    def _kept(self, w: Array, p: Array, status: Status) -> _Found:
        """Return the best point seen, or `w`."""
        best = w if self.watch.best is None else self.watch.best[1]
        cost = np.inf if self.watch.best is None else self.watch.best[0]
        return _Found(best, p, np.zeros(0), np.zeros(0), status, cost)


class _Watch(ca.Callback):
    """Called after every iteration: keeps the best point, hears Ctrl-C."""

    def __init__(self, runner: _Runner, n: int, n_g: int, n_p: int) -> None:
        super().__init__()
        self.runner, self.sizes = runner, (n, 1, n_g, n, n_g, n_p)
        self.best: tuple[float, Array, float] | None = None
        self.interrupted = False
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return str(ca.nlpsol_out(i))

    def get_sparsity_in(self, i: int) -> Any:
        return ca.Sparsity.dense(self.sizes[i], 1)

    def eval(self, arguments: Any) -> Any:
        try:
            cost = 2.0 * float(arguments[1])
            gap = float(np.abs(arguments[2].full()).max(initial=0.0))
            self._heard(cost, gap, arguments[0])
            return [0]
        except KeyboardInterrupt:
            self.interrupted = True
            return [1]

    def _heard(self, cost: float, gap: float, w: Any) -> None:
        runner = self.runner
        worth = max(gap, FEASIBLE)
        if self.best is None or (worth, cost) <= (self.best[2], self.best[0]):
            self.best = (cost, w.full().ravel(), worth)
        if np.isfinite(cost):
            runner.trace.append(cost)
        if runner.options.report is not None:
            runner.options.report(len(runner.trace) - 1, cost)


def _begin(stack: Stack, start: Stacked, n_sub: int) -> tuple[tuple[Record, ...], Array]:
    """Records and first unknowns: windows that follow the readings at the start values."""
    records, parts = [], [start.theta]
    for r, problem in enumerate(stack.problems):
        record = record_of(stack, r, n_sub)
        cut = _windows(problem, None)
        first, stages = followed(record, start.theta, _observed(stack, start, r, cut), cut)
        scales = scales_along(record, start.theta, first, stages)
        if record.step.n_z:
            first = rescaled(first, record.scales, scales)
            stages = rescaled(stages, record.scales, scales)
            record = record_of(stack, r, n_sub, scales, record.program)
        records.append(record)
        parts += [first, stages.ravel(order="F")]
    return tuple(records), np.concatenate(parts)


def _finer(
    stack: Stack, made: Programme, old: tuple[Record, ...], w: Array, n_sub: int
) -> tuple[tuple[Record, ...], Array]:
    """Return shorter steps through the nodes of the longer ones."""
    theta, firsts, stages = made.split(w)
    records, found = [], []
    for r, (record, first, v) in enumerate(zip(old, firsts, stages, strict=True)):
        fine = record_of(stack, r, n_sub, record.scales, record.program)
        size = record.size
        nodes = np.concatenate([first[:, None], v[-size:]], axis=1)
        ratio = n_sub // record.n_sub
        u = fine.u.reshape(-1, record.steps, ratio).transpose(2, 0, 1)
        t = fine.t.reshape(record.steps, ratio).T
        inner, _ = march(fine.step, theta, nodes[:, :-1], u, t, fine.h)
        whole = inner.transpose(1, 2, 0).reshape(size * STAGES, fine.steps)
        held = np.tile(np.repeat(nodes[:, :-1], ratio, axis=1), (STAGES, 1))
        records.append(fine)
        found.append(np.where(np.isfinite(whole), whole, held))
    return tuple(records), made.joined(theta, firsts, found)


def _defects(made: Programme, w: Array) -> list[Array]:
    """What shorter steps add to each step, scaled; shape (n_x, steps) each."""
    theta, firsts, stages = made.split(w)
    found = []
    for record, first, v in zip(made.records, firsts, stages, strict=True):
        size, n_x, steps = record.size, record.step.n_x, record.steps
        nodes = np.concatenate([first[:, None], v[-size:]], axis=1)
        u = record.inputs(FINER).reshape(-1, steps, FINER).transpose(2, 0, 1)
        t = record.t[None] + np.arange(FINER)[:, None] * record.h / FINER
        _, ends = march(record.step, theta, nodes[:, :-1], u, t, record.h / FINER)
        gap = ends[:n_x] - nodes[:n_x, 1:]
        found.append(np.where(np.isfinite(gap), gap, 0.0))
    return found


@dataclass(frozen=True, eq=False)
class _System:
    """Optimality system with theta eliminated last.

    Attributes
    ----------
    factor : SuperLU
        Of trajectories and multipliers, in order of time.
    order : ndarray of int
        Their places in (unknowns, constraints), by time.
    border : ndarray, shape (len(order), n_inner)
        Their coupling to the free entries of theta.
    inner : ndarray of int
        Free entries of theta.
    covariance : ndarray, shape (n, n)
        Zero where theta is held.
    """

    factor: Any
    order: Array
    border: Array
    inner: Array
    covariance: Array
    count: int

    def moved(self, gap: Array, n_w: int) -> Array:
        """How far theta moves if the constraints are moved by `gap`."""
        right = np.concatenate([np.zeros(n_w), gap])[self.order]
        across = -self.border.T @ self.factor.solve(right)
        return np.asarray(self.covariance[np.ix_(self.inner, self.inner)] @ across * self.count)


def _system(runner: _Runner, found: _Found) -> _System | None:
    """Factor the optimality system; None if that fails."""
    if not found.done:
        return None
    solver, made = runner.first, runner.made
    n, n_w, count = made.stack.n, made.w.numel(), made.count
    j = solver.get_function("nlp_jac_g")(found.w, found.p)[1].sparse().tocsc()
    upper = solver.get_function("nlp_hess_l")(found.w, found.p, 1.0, found.multipliers)
    upper = upper.sparse().tocsc()
    h = upper + sparse.triu(upper, 1).T
    moving = runner.upper > runner.lower
    moving[:n] &= (found.w[:n] > runner.lower[:n] + EDGE) & (found.w[:n] < runner.upper[:n] - EDGE)
    inner = np.flatnonzero(moving[:n])
    whole = sparse.bmat([[h, j.T], [j, None]], format="csc")
    when = np.concatenate(made.times())
    chosen = np.concatenate([moving, np.ones(j.shape[0], bool)])
    chosen[:n] = False
    order = np.flatnonzero(chosen)
    order = order[np.argsort(when[order], kind="stable")]
    border = whole[:, inner].toarray()
    try:
        factor = splu(whole[order][:, order].tocsc(), permc_spec="NATURAL")
        across = border[order].T @ factor.solve(border[order])
        inverse = np.linalg.inv(border[inner] - across) / count
    except (RuntimeError, np.linalg.LinAlgError):
        return None
    covariance = np.zeros((n, n))
    covariance[np.ix_(inner, inner)] = inverse
    return _System(factor, order, border[order], inner, covariance, count)


def _shift(runner: _Runner, found: _Found, system: _System | None) -> tuple[float, list[Array]]:
    """How far the defects move theta, in standard errors, and the defects."""
    if system is None:
        return np.inf, []
    made = runner.made
    defects = _defects(made, found.w)
    right = []
    for record, d in zip(made.records, defects, strict=True):
        size, n_x = record.size, record.step.n_x
        wide = np.zeros((size * STAGES, record.steps))
        wide[size * (STAGES - 1) : size * (STAGES - 1) + n_x] = d
        right.append(wide.ravel(order="F"))
        right.append(np.zeros(record.step.n_z))
        if record.problem.initial == "rest":
            right.append(np.zeros(n_x))
    moved = system.moved(np.concatenate(right), made.w.numel())
    error = np.sqrt(np.maximum(np.diag(system.covariance)[system.inner], 1e-300))
    return float((np.abs(moved) / error).max(initial=0.0)), defects


def _solution(
    made: Programme, runner: _Runner, found: _Found, shift: float, trace: list[float]
) -> Solution:
    stack = made.stack
    theta, firsts, stages = made.split(found.w)
    states = []
    for record, first in zip(made.records, firsts, strict=True):
        x = np.empty((1, record.step.n_x))
        x[0, record.order] = first[: record.step.n_x] * record.scales.x
        states.append(x)
    point = Stacked(theta.copy(), tuple(states))
    costs = (*[c for c in trace if np.isfinite(c)], found.cost)
    notes = []
    if shift > COARSE and found.done:
        notes.append(
            f"collocation: even {made.records[0].n_sub} steps a sample leave an error; it moves an "
            f"unknown by {shift:.1g} standard errors"
        )
    if found.status in (Status.CONVERGED, Status.ITERATIONS, Status.NO_PROGRESS):
        for n in FINE_RUNS:
            free = replace(
                stack, problems=tuple(replace(p, n_sub=n, correction=None) for p in stack.problems)
            )
            cost = free.cost(free.evaluate(point, derivatives=False), point)
            if np.isfinite(cost) and cost <= FREE_RUN_LOSS * found.cost:
                return Solution(point, found.status, costs, notes=tuple(notes))
    notes.append(
        "the free run diverges from the trajectory (unstable or integrating): the readings shown "
        "are those of the trajectory up to the last training sample, then of a free run"
    )
    covariance = np.full((stack.n, stack.n), np.nan)
    if (system := _system(runner, found)) is not None:
        covariance = system.covariance
    seen = made.readings(found.w)
    seen = [seen] if len(made.records) == 1 else seen
    readings = tuple(
        _shown(stack, record, theta, np.asarray(y.full().T), v)
        for record, y, v in zip(made.records, seen, stages, strict=True)
    )
    return Solution(point, found.status, costs, covariance, tuple(notes), readings)


def _shown(stack: Stack, record: Record, theta: Array, y: Array, stages: Array) -> Array:
    """Readings of the whole record: those of the trajectory, then a free run from its end."""
    p = record.problem
    if record.last == p.data.n:
        return y
    r = stack.problems.index(p)
    local = theta[stack.columns[r]] * stack.factors[r]
    engine: Engine = p.engine
    from identification.residual import offset_scale, parameters_at

    x = np.empty(record.step.n_x)
    x[record.order] = stages[-record.size :, -1][: record.step.n_x] * record.scales.x
    ready = engine.prepare(parameters_at(p, local), p.data.dt, FINE_RUNS[-1], (), False)
    rest = slice(record.last - 1, p.data.n)
    fine = engine.fine_inputs(p.inputs, FINE_RUNS[-1], p.data.hold)
    run = engine.run(ready, p.inputs[rest], x, fine[rest.start * FINE_RUNS[-1] :])
    later = run.y[1:, : y.shape[1]] + local[slots(p).offsets] * offset_scale(p)
    return np.concatenate([y, later])
