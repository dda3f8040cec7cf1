"""Direct collocation: states at every sample are unknowns, the equations are constraints.

Radau IIA of order 5 (three stages, L-stable), the sparse programme solved by IPOPT with exact
derivatives; Biegler, Nonlinear Programming (SIAM 2010), ch. 10. What the steps leave out is found
by steps four times shorter and allowed to the constraints (defect correction, Stetter, Numer. Math.
29 (1978) 425), so that the solution is that of the differential equations.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, final

import numpy as np

from bondgraph.laws.law import Law
from bondgraph.simulation.dynamics import Dynamics
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.methods.collocated import CollocatedRecord, record_of
from identification.estimation.methods.interior_point import Found, Runner
from identification.estimation.methods.method import FitOptions, FitTask, Method, MethodSolution
from identification.estimation.methods.optimality import optimality, shifted
from identification.estimation.methods.radau import STAGES
from identification.estimation.methods.trajectory import (
    followed,
    observed,
    rescaled,
    scales_along,
    windows_of,
)
from identification.estimation.methods.transcription import Programme, programme
from identification.study.free_parameters import refuse_clocks
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import offset_scale, parameters_at, slots, values_at
from identification.study.study import Study

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


@final
class Collocation(Method):
    """For unstable and integrating plants of moderate length."""

    name: ClassVar[str] = "collocation"
    optimisers: ClassVar[tuple[str, ...]] = ("ipopt",)

    def check(self, study: Study) -> None:
        """Refuse memory, which needs equations of its own, jumps, dead times, clocks, windows."""
        instead = "use method='single_shooting'"
        for e in study.graph.elements.values():
            law, drive = getattr(e, "law", None), getattr(e, "drive", None)
            if not isinstance(law, Law):
                law = None  # that of a field is smooth, and has no memory
            if law is not None and law.n_memory:
                raise UnusableInput(f"collocation: the law of {e.name} has memory; {instead}")
            if law is not None and law.set_valued:
                raise UnusableInput(f"collocation: the law of {e.name} jumps; {instead}")
            if getattr(e, "delay", None) or (drive is not None and drive.delay):
                raise UnusableInput(f"collocation: {e.name} has a dead time; {instead}")
        refuse_clocks(study.graph, self.name)
        if study.nuisances.clock:
            raise UnusableInput(f"collocation fits no clocks of the sensors; {instead}")
        if study.window is not None:
            raise UnusableInput("collocation has no use for windows: leave window out")

    def solve(self, task: FitTask) -> MethodSolution:
        """Solve, halve the steps while they are coarse, then correct what they leave out."""
        stack, lower, upper = task.stack, *task.stack.bounds
        start = replace(task.start, theta=np.clip(task.start.theta, lower, upper))
        trace: list[float] = []
        reached: list[tuple[Runner, Found, float]] = []
        try:
            self._descend(stack, start, task.options, trace, reached)
        except KeyboardInterrupt:
            if not reached:
                return MethodSolution(start, FitStatus.CANCELLED, (np.inf,))
            runner, found, shift = reached[-1]
            reached.append((runner, replace(found, status=FitStatus.CANCELLED), shift))
        runner, found, shift = reached[-1]
        return _solution(runner.made, runner, found, shift, trace)

    def _descend(
        self,
        stack: JointProblem,
        start: JointPoint,
        options: FitOptions,
        trace: list[float],
        reached: list[tuple[Runner, Found, float]],
    ) -> None:
        """Append every solution of a programme to `reached`."""
        n_sub, records, w = 1, *_begin(stack, start, 1)
        coarse = COARSE if options.tolerance <= ROUGH else LOOSE
        while True:
            made = programme(stack, records, w[: stack.n])
            runner = Runner(made, options, trace)
            allowed = [np.zeros((r.step.n_x, r.steps)) for r in records]
            found = runner.run(w, allowed)
            reached.append((runner, found, np.inf))
            system = optimality(runner, found)
            shift, defects = shifted(runner, found, system)
            reached.append((runner, found, shift))
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
            shift, defects = shifted(runner, found, system)
            reached.append((runner, found, shift))
            if shift > 0.7 * before:
                break


def _begin(
    stack: JointProblem, start: JointPoint, n_sub: int
) -> tuple[tuple[CollocatedRecord, ...], Array]:
    """Return records and first unknowns: windows that follow the readings at the start values."""
    records, parts = [], [start.theta]
    for r, problem in enumerate(stack.problems):
        record = record_of(stack, r, n_sub)
        cut = windows_of(problem)
        first, stages = followed(
            record,
            start.theta,
            values_at(problem, stack.local(start, r).theta),
            observed(stack, start, r, cut, correction=None, initial="free"),
            cut,
        )
        scales = scales_along(record, start.theta, first, stages)
        if record.step.n_z:
            first = rescaled(first, record.scales, scales)
            stages = rescaled(stages, record.scales, scales)
            record = record_of(stack, r, n_sub, scales, record.program)
        records.append(record)
        parts += [first, stages.ravel(order="F")]
    return tuple(records), np.concatenate(parts)


def _finer(
    stack: JointProblem, made: Programme, old: tuple[CollocatedRecord, ...], w: Array, n_sub: int
) -> tuple[tuple[CollocatedRecord, ...], Array]:
    """Return shorter steps through the nodes of the longer ones."""
    theta, firsts, stages = made.split(w)
    records, found = [], []
    for r, (record, first, v) in enumerate(zip(old, firsts, stages, strict=True)):
        fine = record_of(stack, r, n_sub, record.scales, record.program)
        ratio = n_sub // record.n_sub
        nodes, inner, _ = record.within(theta, first, v, ratio)
        whole = inner.transpose(1, 2, 0).reshape(record.size * STAGES, fine.steps)
        held = np.tile(np.repeat(nodes[:, :-1], ratio, axis=1), (STAGES, 1))
        records.append(fine)
        found.append(np.where(np.isfinite(whole), whole, held))
    return tuple(records), made.joined(theta, firsts, found)


def _solution(
    made: Programme, runner: Runner, found: Found, shift: float, trace: list[float]
) -> MethodSolution:
    stack = made.stack
    theta, firsts, stages = made.split(found.w)
    states = []
    for record, first in zip(made.records, firsts, strict=True):
        x = np.empty((1, record.step.n_x))
        x[0, record.order] = first[: record.step.n_x] * record.scales.x
        states.append(x)
    point = JointPoint(theta.copy(), tuple(states))
    costs = (*[c for c in trace if np.isfinite(c)], found.cost)
    notes = []
    if shift > COARSE and found.done:
        notes.append(
            f"collocation: even {made.records[0].n_sub} steps a sample leave an error; it moves an "
            f"unknown by {shift:.1g} standard errors"
        )
    if found.status in (FitStatus.CONVERGED, FitStatus.ITERATIONS, FitStatus.NO_PROGRESS):
        for n in FINE_RUNS:
            free = replace(
                stack, problems=tuple(replace(p, n_sub=n, correction=None) for p in stack.problems)
            )
            cost = free.cost(free.evaluate(point, derivatives=False), point)
            if np.isfinite(cost) and cost <= FREE_RUN_LOSS * found.cost:
                return MethodSolution(point, found.status, costs, notes=tuple(notes))
    notes.append(
        "the free run diverges from the trajectory (unstable or integrating): the readings shown "
        "are those of the trajectory up to the last training sample, then of a free run"
    )
    covariance = np.full((stack.n, stack.n), np.nan)
    if (system := optimality(runner, found)) is not None:
        covariance = system.covariance
    seen = made.readings(found.w)
    seen = [seen] if len(made.records) == 1 else seen
    readings = tuple(
        _shown(stack, record, theta, np.asarray(y.full().T), v)
        for record, y, v in zip(made.records, seen, stages, strict=True)
    )
    return MethodSolution(
        point, found.status, costs, covariance, tuple(notes), readings,
        run="a trajectory fitted up to the last training sample, then a free run from its end",
    )  # fmt: skip


def _shown(
    stack: JointProblem, record: CollocatedRecord, theta: Array, y: Array, stages: Array
) -> Array:
    """Return readings of the whole record: the trajectory, then a free run from its end."""
    p = record.problem
    if record.last == p.data.n:
        return y
    r = stack.problems.index(p)
    local = theta[stack.columns[r]] * stack.factors[r]
    dynamics: Dynamics = p.dynamics
    x = np.empty(record.step.n_x)
    x[record.order] = stages[-record.size :, -1][: record.step.n_x] * record.scales.x
    ready = dynamics.prepare(parameters_at(p, local), p.data.dt, FINE_RUNS[-1], (), False)
    rest = slice(record.last - 1, p.data.n)
    fine = dynamics.fine_inputs(p.inputs, FINE_RUNS[-1], p.data.between)
    run = dynamics.run(ready, p.inputs[rest], x, fine[rest.start * FINE_RUNS[-1] :])
    later = run.y[1:, : y.shape[1]] + local[slots(p).offsets] * offset_scale(p)
    return np.concatenate([y, later])
