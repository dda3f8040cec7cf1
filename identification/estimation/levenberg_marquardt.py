"""Levenberg-Marquardt on a stack of records: exact derivatives, bounds, a status in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from identification.study.joint import JointPoint, JointProblem, NormalEquations, refine_states
from identification.study.residual import ResidualEvaluation

Report = Callable[[int, float], None]
"""Called after every iteration with its number and the cost."""


class FitStatus(Enum):
    """How a fit ended, in words."""

    CONVERGED = "converged"
    NO_PROGRESS = "stopped: no step lowers the misfit any more (flat or kinked valley)"
    ITERATIONS = "stopped at the largest number of iterations; raise max_iterations"
    CANCELLED = "cancelled: the best values so far"
    RUNAWAY = (
        "failed: the free run leaves the readings far behind (unstable); fit by multiple_shooting"
    )
    BROKEN = "failed: the simulation is not finite at the start values; give other starts"


@dataclass(frozen=True, eq=False)
class Descent:
    """Result of a descent.

    Attributes
    ----------
    point : JointPoint
        Best point found.
    evaluations : tuple of ResidualEvaluation
        Simulations there, with derivatives.
    cost : float
        Mean square of residuals and priors.
    trace : tuple of float
        Cost at the start and after each iteration.
    """

    point: JointPoint
    evaluations: tuple[ResidualEvaluation, ...]
    status: FitStatus
    cost: float
    trace: tuple[float, ...]

    @property
    def iterations(self) -> int:
        """Number of iterations."""
        return len(self.trace) - 1


def minimise(
    stack: JointProblem,
    start: JointPoint,
    *,
    max_iterations: int = 40,
    tolerance: float = 1e-5,
    report: Report | None = None,
    keep_on_interrupt: bool = False,
) -> Descent:
    """Minimise the misfit of `stack` from `start`.

    Converged if an iteration lowers the cost by less than `tolerance` (relative). With
    `keep_on_interrupt` a KeyboardInterrupt ends the descent with the best point so far.
    """
    lower, upper = stack.bounds
    point = replace(start, theta=np.clip(start.theta, lower, upper))
    now = stack.evaluate(point)
    cost = stack.cost(now, point)
    if not np.isfinite(cost):
        return Descent(point, now, FitStatus.BROKEN, np.inf, (np.inf,))
    trace, count = [cost], stack.count(now)
    damping, status = 1e-3, FitStatus.ITERATIONS
    try:
        for _ in range(max_iterations):
            system = stack.normal(now, point)
            first, settled = True, False
            while True:
                trial = stack.step(system, point, damping)
                if not np.isfinite(trial.theta).all():  # derivatives too large to compute with
                    damping = np.inf
                    break
                after = stack.evaluate(trial, derivatives=first)
                trial_cost = stack.cost(after, trial)
                if np.isfinite(trial_cost) and trial_cost <= cost:
                    if first:
                        break
                    after = stack.evaluate(trial)
                    trial_cost = stack.cost(after, trial)
                    if trial_cost <= cost:
                        break
                if first and _promised(stack, system, point) < tolerance * cost * count:
                    damping, settled = np.inf, True  # what a step could gain is rounding
                    break
                # a step that must be shortened is likely to be shortened again
                first = False
                damping *= 8.0
                if damping > 1e9:
                    break
            if damping > 1e9:
                freed = _unstick(stack, point, cost)
                if freed is None:
                    status = FitStatus.CONVERGED if settled else FitStatus.NO_PROGRESS
                    break
                (point, now, cost), damping = freed, 1e-2
                trace.append(cost)
                continue
            gain = (cost - trial_cost) / max(cost, 1e-300)
            moved = float(np.abs(trial.theta - point.theta).max(initial=0.0))
            point, now, cost = trial, after, trial_cost
            trace.append(cost)
            damping = max(damping / 6.0, 1e-9)
            if report is not None:
                report(len(trace) - 1, cost)
            if gain < tolerance or (gain < 100 * tolerance and moved < 1e-4):
                status = FitStatus.CONVERGED
                break
    except KeyboardInterrupt:
        if not keep_on_interrupt:
            raise
        status = FitStatus.CANCELLED
    return Descent(point, now, status, cost, tuple(trace))


def _promised(stack: JointProblem, system: NormalEquations, point: JointPoint) -> float:
    """Return by how much an undamped step lowers the sum of squares, as the derivatives say."""
    delta = stack.step(system, point, 0.0).theta - point.theta
    after = system.right - system.factor @ delta
    return float(system.right @ system.right - after @ after)


def _unstick(
    stack: JointProblem, point: JointPoint, cost: float
) -> tuple[JointPoint, tuple[ResidualEvaluation, ...], float] | None:
    """Move the windows' states on their own when no joint step lowers the misfit."""
    if all(p.window is None for p in stack.problems):
        return None
    states = tuple(
        refine_states(p, stack.local(point, r), passes=4).states
        for r, p in enumerate(stack.problems)
    )
    moved = JointPoint(point.theta, states)
    after = stack.evaluate(moved)
    new = stack.cost(after, moved)
    return (moved, after, new) if new < cost * (1 - 1e-3) else None
