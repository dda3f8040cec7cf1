"""Records of a study as one sparse nonlinear programme: states, defects, weighted readings."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.integrate import inputs_of
from bondgraph.program import Program
from bondgraph.programming import program
from identification.estimation.methods.radau import (
    Scales,
    Step,
    march,
    stage_inputs,
    step_of,
)
from identification.problem import Problem
from identification.residual import offset_scale, parameters_at, slots
from identification.stack import STATE_WEIGHT, Stack

__all__ = [
    "STAGES",
    "Programme",
    "Record",
    "followed",
    "programme",
    "record_of",
    "rescaled",
    "scales_along",
]

Array = np.ndarray
STAGES = 3
TAPS = 4
"""Samples on either side of a late reading that its interpolation takes."""


@dataclass(frozen=True, eq=False)
class Record:
    """One recording up to its last training sample.

    Attributes
    ----------
    last : int
        Samples that take part.
    order : ndarray of int
        Position of each state of the programme among those of the engine.
    u, nodes, t : ndarray
        Inputs at the stages and at the nodes, begin of each step.
    """

    problem: Problem
    program: Program
    step: Step
    scales: Scales
    n_sub: int
    last: int
    order: Array
    u: Array
    nodes: Array
    t: Array

    @property
    def size(self) -> int:
        """States and algebraic unknowns of a node."""
        return self.step.n_x + self.step.n_z

    @property
    def h(self) -> float:
        """Time of a step, s."""
        return self.problem.data.dt / self.n_sub

    @property
    def steps(self) -> int:
        """Number of steps."""
        return (self.last - 1) * self.n_sub

    def inputs(self, finer: int) -> Array:
        """Inputs at the stages of steps `finer` times shorter, shape (n_u * stages, ...)."""
        return _staged(self.program, self.problem, finer * self.n_sub, self.last)[0]


def _staged(made: Program, problem: Problem, n_sub: int, last: int) -> tuple[Array, Array]:
    u = inputs_of(made, problem.data.commands, problem.data.time)
    staged, nodes = stage_inputs(made, u, problem.data.dt, n_sub, problem.data.hold, STAGES)
    steps = (last - 1) * n_sub
    return staged[:, :steps], nodes[:, : steps + 1]


def record_of(
    stack: Stack, r: int, n_sub: int, scales: Scales | None = None, made: Program | None = None
) -> Record:
    """Transcribe a recording; algebraic unknowns have unit scales unless `scales` are given."""
    problem = stack.problems[r]
    made = program(problem.with_offsets) if made is None else made
    order = np.array([problem.engine.state_names.index(n) for n in made.states], int)
    n_z = len(made.algebraic)
    if scales is None:
        scales = Scales(problem.state_scale[order], np.ones(n_z), np.ones(n_z))
    theta = ca.SX.sym("theta", stack.n)
    step = step_of(
        made, theta, _parameters(stack, r, made.parameters, theta), problem.data.names, scales,
        STAGES,
    )  # fmt: skip
    trained = np.flatnonzero(problem.data.mask("train"))
    last = min(problem.data.n, int(trained[-1]) + 1 + TAPS) if trained.size else 2
    u, nodes = _staged(made, problem, n_sub, last)
    t = np.arange(u.shape[1]) * (problem.data.dt / n_sub)
    return Record(problem, made, step, scales, n_sub, last, order, u, nodes, t)


def _parameters(stack: Stack, r: int, names: tuple[str, ...], theta: ca.SX) -> ca.SX:
    p = stack.problems[r]
    engine = p.engine
    start = dict(zip(engine.parameter_names, parameters_at(p, np.zeros(0)), strict=True))
    local = theta[stack.columns[r].tolist()] * stack.factors[r]
    value: dict[str, Any] = dict(start)
    for i, f in enumerate(p.free):
        name = f.parameter.name
        value[name] = f.start * ca.exp(local[i]) if f.log else f.start + f.scale * local[i]
    return ca.vertcat(*[value[n] for n in names])


@dataclass(frozen=True, eq=False)
class Programme:
    """A nonlinear programme: ``min f(w) s.t. g(w, p) = 0``.

    ``w`` is theta, then record by record the first node and the stages of all steps. ``p`` are
    the defects allowed to the steps and the rest states with their slopes.

    Attributes
    ----------
    readings : casadi.Function
        ``w -> readings`` of every record, offsets and lags included, (n_y, last) each.
    """

    stack: Stack
    records: tuple[Record, ...]
    w: ca.MX
    p: ca.MX
    f: ca.MX
    g: ca.MX
    residual: ca.MX
    readings: ca.Function
    count: int

    def split(self, w: Array) -> tuple[Array, list[Array], list[Array]]:
        """Theta, first nodes (size,) and stages (size * stages, steps) record by record."""
        at, firsts, stages = self.stack.n, [], []
        for r in self.records:
            firsts.append(w[at : at + r.size])
            at += r.size
            many = r.size * STAGES * r.steps
            stages.append(w[at : at + many].reshape(r.size * STAGES, r.steps, order="F"))
            at += many
        return w[: self.stack.n], firsts, stages

    def joined(self, theta: Array, firsts: list[Array], stages: list[Array]) -> Array:
        """Return the inverse of `split`."""
        parts = [theta]
        for first, v in zip(firsts, stages, strict=True):
            parts += [first, v.ravel(order="F")]
        return np.concatenate(parts)

    def times(self) -> tuple[Array, Array]:
        """Order in time of the unknowns and of the constraints, as numbers."""
        unknowns, constraints, base = [np.zeros(self.stack.n)], [], 0.0
        for r in self.records:
            many = r.size * STAGES
            by_step = base + 1.0 + np.repeat(np.arange(r.steps), many)
            unknowns += [np.full(r.size, base), by_step]
            constraints.append(by_step)
            tied = r.step.n_z + (r.step.n_x if r.problem.initial == "rest" else 0)
            constraints.append(np.full(tied, base))
            base += r.steps + 2.0
        return np.concatenate(unknowns), np.concatenate(constraints)

    def parameters(self, allowed: list[Array], theta: Array) -> Array:
        """Values of ``p``: defects (n_x, steps) of each record, rest states at theta."""
        parts = []
        for r, (record, defect) in enumerate(zip(self.records, allowed, strict=True)):
            parts.append(defect.ravel(order="F"))
            if record.problem.initial == "rest":
                value, slope = self._rest(r, theta)
                parts += [value - slope @ theta, slope.ravel(order="F")]
        return np.concatenate(parts)

    def _rest(self, r: int, theta: Array) -> tuple[Array, Array]:
        """Scaled rest state and its slope by theta, by central differences."""
        record, stack = self.records[r], self.stack
        p = record.problem

        def rest(local: Array) -> Array:
            found = p.engine.rest(parameters_at(p, local), p.inputs[0])
            return np.asarray(found[record.order] / record.scales.x)

        local = theta[stack.columns[r]] * stack.factors[r]
        slope = np.zeros((record.step.n_x, stack.n))
        for i in range(len(p.free)):
            ends = [local.copy(), local.copy()]
            ends[0][i] += 1e-5
            ends[1][i] -= 1e-5
            slope[:, stack.columns[r][i]] = (rest(ends[0]) - rest(ends[1])) / 2e-5
        return rest(local), slope


def programme(stack: Stack, records: tuple[Record, ...], begin: Array) -> Programme:
    """Build objective, constraints and readings for a fit that begins at theta = `begin`."""
    theta = ca.MX.sym("theta", stack.n)
    unknowns, parameters, constraints = [theta], [], []
    residuals, shown = [], []
    weight, centre = stack.prior
    count = 0
    for r, record in enumerate(records):
        size, n_x, steps = record.size, record.step.n_x, record.steps
        first = ca.MX.sym(f"first{r}", size)
        v = ca.MX.sym(f"v{r}", size * STAGES * steps)
        allowed = ca.MX.sym(f"allowed{r}", n_x * steps)
        unknowns += [first, v]
        parameters.append(allowed)
        stages = ca.reshape(v, size * STAGES, steps)
        nodes = ca.horzcat(first, stages[-size:, :])
        wide = ca.repmat(theta, 1, steps)
        defect = record.step.defect.map(steps)(
            wide, nodes[:n_x, :-1], stages, record.u, record.t[None], record.h
        )
        extra = ca.MX(size * STAGES, steps)
        extra[size * (STAGES - 1) : size * (STAGES - 1) + n_x, :] = ca.reshape(allowed, n_x, steps)
        constraints.append(ca.vec(defect - extra))
        if record.step.n_z:
            at = (theta, first[:n_x], first[n_x:], record.nodes[:, 0], 0.0)
            constraints.append(record.step.closing(*at))
        residuals += _start(stack, r, record, theta, first, parameters, constraints)
        y = _seen(stack, r, record, theta, nodes, begin)
        shown.append(y)
        rest = _misfit(record, y)
        count += rest.numel()
        residuals.append(rest)
    pulled = np.flatnonzero(weight)
    if pulled.size:
        residuals.append(weight[pulled] * (theta[pulled.tolist()] - centre[pulled]))
    residual = ca.vertcat(*residuals)
    w = ca.vertcat(*unknowns)
    return Programme(
        stack, records, w, ca.vertcat(*parameters), 0.5 * ca.sumsqr(residual) / max(count, 1),
        ca.vertcat(*constraints), residual, ca.Function("readings", [w], shown), max(count, 1),
    )  # fmt: skip


def _start(
    stack: Stack,
    r: int,
    record: Record,
    theta: ca.MX,
    first: ca.MX,
    parameters: list[ca.MX],
    constraints: list[ca.MX],
) -> list[ca.MX]:
    """Tie the first node to the rest, or pull what is free of it gently towards it."""
    n_x, problem = record.step.n_x, record.problem
    if problem.initial == "rest":
        value = ca.MX.sym(f"rest{r}", n_x)
        slope = ca.MX.sym(f"slope{r}", n_x * stack.n)
        parameters += [value, slope]
        constraints.append(first[:n_x] - value - ca.reshape(slope, n_x, stack.n) @ theta)
        return []
    free = [i for i in range(n_x) if record.order[i] in problem.free_states]
    if not free:
        return []
    rest = problem.rest_state[record.order] / record.scales.x
    unit = record.scales.x / problem.state_scale[record.order]
    return [STATE_WEIGHT * unit[free] * (first[free] - rest[free])]


def _seen(stack: Stack, r: int, record: Record, theta: ca.MX, nodes: ca.MX, begin: Array) -> ca.MX:
    """Readings at the samples with lags and offsets, shape (n_y, last)."""
    n_x, problem, n = record.step.n_x, record.problem, record.last
    at = slots(problem)
    columns = list(range(0, record.steps + 1, record.n_sub))
    here = nodes[:, columns]
    u, t = record.nodes[:, columns], np.arange(n)[None] * problem.data.dt
    y = record.step.reading.map(n)(ca.repmat(theta, 1, n), here[:n_x, :], here[n_x:, :], u, t)
    lower, upper = stack.bounds
    rows = []
    for c in range(len(problem.data.names)):
        row = y[c, :]
        lag = int(stack.columns[r][at.lags.start + c])
        if upper[lag] > lower[lag]:
            row = _late(row, theta[lag], n, int(np.floor(begin[lag])))
        place = int(stack.columns[r][at.offsets.start + c])
        if upper[place] > lower[place]:
            row = row + theta[place] * float(offset_scale(problem)[c])
        rows.append(row)
    return ca.vertcat(*rows)


def _late(row: ca.MX, lag: ca.MX, n: int, whole: int) -> ca.MX:
    """Delay by a fraction of a sample: eight-point Lagrange, as `bondgraph.shift.delayed`.

    `whole` is the lag rounded down where the fit begins.
    """
    wide = ca.horzcat(ca.repmat(row[:, 0], 1, TAPS), row, ca.repmat(row[:, n - 1], 1, TAPS))
    nodes = np.arange(-3, 5) + whole
    total: Any = 0.0
    for i in nodes:
        weight: Any = 1.0
        for j in nodes[nodes != i]:
            weight = weight * (lag - float(j)) / float(i - j)
        total = total + weight * wide[:, int(TAPS - i) : int(TAPS - i) + n]
    return total


def _misfit(record: Record, y: ca.MX) -> ca.MX:
    """Training residuals over their noise, whitened where it is coloured."""
    problem, found = record.problem, []
    chosen = np.flatnonzero(problem.data.mask("train")[: record.last])
    for c, floor in enumerate(problem.data.floor):
        e = (problem.data.readings[chosen, c] - y[c, chosen.tolist()].T) / float(floor)
        if problem.whitening and (order := problem.whitening[c].size - 1):
            n = chosen.size - order
            filtered: Any = 0.0
            for j, a in enumerate(problem.whitening[c]):
                filtered = filtered + float(a) * e[order - j : order - j + n]
            e = filtered
        found.append(e)
    return ca.vertcat(*found)


def followed(record: Record, theta: Array, states: Array, cut: list[slice]) -> tuple[Array, Array]:
    """Trajectory (first node, stages) from states at the first samples of windows.

    Parameters
    ----------
    states : ndarray, shape (windows, n_x), SI, in the order of the engine
    cut : list of slice
        Windows that share their edges.
    """
    m, size, n_x = record.n_sub, record.size, record.step.n_x
    begins = [c.start for c in cut if c.start < record.last - 1]
    longest = max(c.stop - 1 - c.start for c in cut) * m
    count = len(begins)
    begin = np.zeros((size, count))
    begin[:n_x] = (states[:count, record.order] / record.scales.x).T
    index = np.array(begins)[None] * m + np.arange(longest)[:, None]
    index = np.minimum(index, record.u.shape[1] - 1)
    u = record.u[:, index].transpose(1, 0, 2)
    v, _ = march(record.step, theta, begin, u, record.t[index], record.h)
    v = np.where(np.isfinite(v), v, np.tile(begin, (STAGES, 1))[None])
    stages = np.empty((size * STAGES, record.steps))
    edges = [*begins, record.last - 1]
    for k, (a, b) in enumerate(pairwise(edges)):
        stages[:, a * m : b * m] = v[: (b - a) * m, :, k].T
    first = np.concatenate([begin[:n_x, 0], _closed(record, theta, begin[:, 0], stages)])
    return first, stages


def scales_along(record: Record, theta: Array, first: Array, stages: Array) -> Scales:
    """Scales with those of the algebraic unknowns and their equations from a trajectory."""
    n_x, n_z = record.step.n_x, record.step.n_z
    if not n_z:
        return record.scales
    z = stages[-n_z:]
    unit = np.maximum(z.std(axis=1), 1e-3 * np.abs(z).max(axis=1))
    unit = np.where(np.isfinite(unit) & (unit > 0), unit, 1.0)
    slope = _closing_slope(record)(theta, first[:n_x], first[n_x:], record.nodes[:, 0], 0.0)
    rows = np.abs(slope.full()) @ unit
    rows = np.where(np.isfinite(rows) & (rows > 0), rows, 1.0)
    return Scales(record.scales.x, record.scales.z * unit, record.scales.g * rows)


def rescaled(values: Array, old: Scales, new: Scales) -> Array:
    """Nodes or stages, shape (k (n_x + n_z), ...), from one set of scales to another."""
    ratio = np.concatenate([old.x / new.x, old.z / new.z])
    shape = (-1, ratio.size, *values.shape[1:])
    by = ratio.reshape(1, -1, *([1] * (values.ndim - 1)))
    return np.asarray((values.reshape(shape) * by).reshape(values.shape))


def _closing_slope(record: Record) -> ca.Function:
    f = record.step.closing
    return f.factory("slope", f.name_in(), [f"jac:{f.name_out(0)}:{f.name_in(2)}"])


def _closed(record: Record, theta: Array, node: Array, stages: Array) -> Array:
    """Algebraic unknowns of the first node by Newton steps from those of the first stage."""
    n_x, n_z = record.step.n_x, record.step.n_z
    if not n_z:
        return np.zeros(0)
    f, slope = record.step.closing, _closing_slope(record)
    z = stages[n_x : n_x + n_z, 0].copy()
    at = (record.nodes[:, 0], 0.0)
    for _ in range(30):
        g = f(theta, node[:n_x], z, *at).full().ravel()
        move = np.linalg.solve(slope(theta, node[:n_x], z, *at).full(), g)
        z = z - move
        if np.abs(move).max() <= 1e-12 * (1 + np.abs(z).max()):
            break
    return z
