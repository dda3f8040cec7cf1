"""Records of a study as one sparse nonlinear programme: states, defects, weighted readings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.methods.collocated import CollocatedRecord, misfit, readings_of
from identification.estimation.methods.radau import STAGES
from identification.study.joint import STATE_WEIGHT, JointProblem
from identification.study.residual import parameters_at, rest_under, slots


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

    stack: JointProblem
    records: tuple[CollocatedRecord, ...]
    w: ca.MX
    p: ca.MX
    f: ca.MX
    g: ca.MX
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
        parts: list[Any] = [theta]
        for first, v in zip(firsts, stages, strict=True):
            parts += [first, v.ravel(order="F")]
        return np.concatenate(parts)

    def times(self) -> tuple[Array, Array]:
        """Order in time of the unknowns and of the constraints, as numbers."""
        unknowns: list[Array] = [np.zeros(self.stack.n)]
        constraints: list[Array] = []
        base = 0.0
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
        """Scaled rest state and its slope by theta."""
        record, stack = self.records[r], self.stack
        p, columns = record.problem, stack.columns[r]
        local = theta[columns] * stack.factors[r]
        x, by_p = rest_under(p.dynamics, parameters_at(p, local), p.inputs[0], p.directions)
        unit = record.scales.x
        slope = np.zeros((record.step.n_x, stack.n))
        slope[:, columns[slots(p).free]] = by_p[record.order] * p.slopes(local) / unit[:, None]
        return x[record.order] / unit, slope


def programme(
    stack: JointProblem, records: tuple[CollocatedRecord, ...], begin: Array
) -> Programme:
    """Build objective, constraints and readings for a fit that begins at theta = `begin`."""
    theta = ca.MX.sym("theta", stack.n)
    unknowns, parameters, constraints = [theta], [], []
    residuals: list[Any] = []
    shown = []
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
        y = readings_of(stack, r, record, theta, nodes, begin)
        shown.append(y)
        rest = misfit(record, y)
        count += rest.numel()
        residuals.append(rest)
    pulled = np.flatnonzero(weight)
    if pulled.size:
        residuals.append(weight[pulled] * (theta[pulled.tolist()] - centre[pulled]))
    residual = ca.vertcat(*residuals)
    w = ca.vertcat(*unknowns)
    return Programme(
        stack, records, w, ca.vertcat(*parameters), 0.5 * ca.sumsqr(residual) / max(count, 1),
        ca.vertcat(*constraints), ca.Function("readings", [w], shown), max(count, 1),
    )  # fmt: skip


def _start(
    stack: JointProblem,
    r: int,
    record: CollocatedRecord,
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
