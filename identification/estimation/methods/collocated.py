"""One recording as steps of collocation: its inputs at the stages, its readings, their misfit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.equations.codegen import program
from bondgraph.equations.program import Program
from bondgraph.simulation.radau.start import inputs_of
from bondgraph.support.arrays import Array
from identification.estimation.methods.radau import (
    CollocationStep,
    Scales,
    march,
    stage_inputs,
    step_of,
)
from identification.study.joint import JointProblem
from identification.study.problem import Problem
from identification.study.residual import offset_scale, parameters_at, slots

TAPS = 4
"""Samples on either side of a late reading that its interpolation may take."""


@dataclass(frozen=True, eq=False)
class CollocatedRecord:
    """One recording up to its last training sample.

    Attributes
    ----------
    last : int
        Samples that take part.
    order : ndarray of int
        Position of each state of the programme among those of the dynamics.
    u, nodes, t : ndarray
        Inputs at the stages and at the nodes, begin of each step.
    """

    problem: Problem
    program: Program
    step: CollocationStep
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

    def within(
        self, theta: Array, first: Array, stages: Array, finer: int
    ) -> tuple[Array, Array, Array]:
        """Return the nodes, and stages and ends of `finer` steps in place of each, from its node.

        Shapes (size, steps + 1), (finer, size * stages, steps) and (size, steps).
        """
        nodes = np.concatenate([first[:, None], stages[-self.size :]], axis=1)
        u, _ = _staged(self.program, self.problem, finer * self.n_sub, self.last)
        u = u.reshape(-1, self.steps, finer).transpose(2, 0, 1)
        t = self.t + np.arange(finer)[:, None] * (self.h / finer)
        return nodes, *march(self.step, theta, nodes[:, :-1], u, t, self.h / finer)


def _staged(made: Program, problem: Problem, n_sub: int, last: int) -> tuple[Array, Array]:
    u = inputs_of(made, problem.data.commands, problem.data.time)
    staged, nodes = stage_inputs(made, u, problem.data.dt, n_sub, problem.data.between)
    steps = (last - 1) * n_sub
    return staged[:, :steps], nodes[:, : steps + 1]


def record_of(
    stack: JointProblem,
    r: int,
    n_sub: int,
    scales: Scales | None = None,
    made: Program | None = None,
) -> CollocatedRecord:
    """Transcribe a recording; algebraic unknowns have unit scales unless `scales` are given."""
    problem = stack.problems[r]
    made = program(problem.with_chain) if made is None else made
    order = np.array([problem.dynamics.state_names.index(n) for n in made.states], int)
    n_z = len(made.algebraic)
    if scales is None:
        scales = Scales(problem.state_scale[order], np.ones(n_z), np.ones(n_z))
    theta = ca.SX.sym("theta", stack.n)
    p = _parameters(stack, r, made.parameters, theta)
    step = step_of(made, theta, p, problem.data.names, scales)
    trained = np.flatnonzero(problem.data.mask("train"))
    last = min(problem.data.n, int(trained[-1]) + 1 + TAPS) if trained.size else 2
    u, nodes = _staged(made, problem, n_sub, last)
    t = np.arange(u.shape[1]) * (problem.data.dt / n_sub)
    return CollocatedRecord(problem, made, step, scales, n_sub, last, order, u, nodes, t)


def _parameters(stack: JointProblem, r: int, names: tuple[str, ...], theta: ca.SX) -> ca.SX:
    p = stack.problems[r]
    dynamics = p.dynamics
    start = dict(zip(dynamics.parameter_names, parameters_at(p, np.zeros(0)), strict=True))
    local = theta[stack.columns[r].tolist()] * stack.factors[r]
    value: dict[str, Any] = dict(start)
    for i, f in enumerate(p.free):
        name = f.parameter.name
        value[name] = f.start * ca.exp(local[i]) if f.log else f.start + f.scale * local[i]
    return ca.SX(ca.vertcat(*[value[n] for n in names]))


def readings_of(
    stack: JointProblem, r: int, record: CollocatedRecord, theta: ca.MX, nodes: ca.MX, begin: Array
) -> ca.MX:
    """Return readings at the samples with lags and offsets, shape (n_y, last)."""
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
    return ca.MX(ca.vertcat(*rows))


def _late(row: ca.MX, lag: ca.MX, n: int, whole: int) -> ca.MX:
    """Delay by a fraction of a sample: eight-point Lagrange, as `fractional_delay.delayed`.

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
    return ca.MX(total)


def misfit(record: CollocatedRecord, y: ca.MX) -> ca.MX:
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
    return ca.MX(ca.vertcat(*found))
