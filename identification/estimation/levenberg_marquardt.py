"""Levenberg-Marquardt on a stack of records: exact derivatives, bounds, a status in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial

import numpy as np

from bondgraph.support.descent import Damping, Ended, Trial, descend
from identification.study.joint import JointPoint, JointProblem, NormalEquations, refine_states
from identification.study.residual import ResidualEvaluation

Report = Callable[[int, float], None]
"""Called after every iteration with its number and the cost."""


class FitStatus(Enum):
    """How a fit ended, in words."""

    CONVERGED = "converged"
    NO_PROGRESS = "stopped: no step lowers the misfit any more (flat or kinked valley)"
    ITERATIONS = (
        "stopped at the largest number of iterations; raise max_iterations (bondsight fit: "
        "--iterations)"
    )
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
    whole: bool = True,
    found: tuple[ResidualEvaluation, ...] | None = None,
) -> Descent:
    """Minimise the misfit of `stack` from `start`.

    Converged if an iteration lowers the cost by less than `tolerance` (relative). With
    `keep_on_interrupt` a KeyboardInterrupt ends the descent with the best point so far. Windows
    without training samples are simulated at the end, if `whole`; else their readings are NaN.
    `found` is what was simulated at the start already.
    """
    lower, upper = stack.bounds
    inside = np.clip(start.theta, lower, upper)
    if found is None or not np.array_equal(inside, start.theta):
        begun = _at(stack, replace(start, theta=inside))
    else:
        begun = _Stand(start, found, stack.cost(found, start))
    if not np.isfinite(begun.cost):
        return Descent(begun.point, begun.evaluations, FitStatus.BROKEN, np.inf, (np.inf,))
    trace = [begun.cost]

    def taken(at: _Stand) -> None:
        trace.append(at.cost)
        if report is not None:
            report(len(trace) - 1, at.cost)

    def arrived(before: _Stand, at: _Stand) -> bool:
        gain = (before.cost - at.cost) / max(before.cost, 1e-300)
        moved = float(np.abs(at.point.theta - before.point.theta).max(initial=0.0))
        return gain < tolerance or (gain < 100 * tolerance and moved < 1e-4)

    go_down = partial(
        descend, arrived=arrived, rescue=lambda at, why: _unstick(stack, at), taken=taken,
        kept=keep_on_interrupt,
    )  # fmt: skip
    made = go_down(begun, lambda at: _steps(stack, at, tolerance), DAMPING, max_iterations)
    left = max_iterations - made.steps
    if made.ended is Ended.STUCK and left and not _eliminated(stack):
        made = go_down(made.at, lambda at: _steps(stack, at, tolerance, _at_first), DAMPING, left)
    best = made.at
    made_there = best.evaluations
    if whole and any(np.isnan(e.y).any() for e in made_there):
        made_there = stack.evaluate(best.point)
    return Descent(best.point, made_there, STATUS[made.ended], best.cost, tuple(trace))


DAMPING = Damping(start=1e-3, less=6.0, more=8.0)
STATUS = {
    Ended.ARRIVED: FitStatus.CONVERGED, Ended.STUCK: FitStatus.NO_PROGRESS,
    Ended.LIMIT: FitStatus.ITERATIONS, Ended.CANCELLED: FitStatus.CANCELLED,
}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class _Stand:
    """A point, the simulations there, with derivatives, and the cost."""

    point: JointPoint
    evaluations: tuple[ResidualEvaluation, ...]
    cost: float


def _at(
    stack: JointProblem, point: JointPoint, *, derivatives: bool = True, limit: float = np.inf
) -> _Stand:
    made = stack.evaluate(point, derivatives=derivatives, scored=True, limit=limit)
    return _Stand(point, made, stack.cost(made, point))


Settling = Callable[[int], float]
"""Part of their own step that initial states take, told how many were tried before."""


def _steps(
    stack: JointProblem, at: _Stand, tolerance: float, settling: Settling = lambda number: 1.0
) -> Trial[_Stand]:
    """Linearise at a point; what makes the damped steps from there."""
    system = stack.normal(at.evaluations, at.point)
    total = at.cost * stack.count(at.evaluations)  # more than that is not taken

    def trial(damping: float, number: int) -> _Stand | Ended | None:
        if number == 1:
            if _promised(stack, system, at.point) < tolerance * total:
                return Ended.ARRIVED  # what a step could gain is rounding
        point = stack.step(system, at.point, damping, settling(number))
        if not np.isfinite(point.theta).all():  # derivatives too large to compute with
            return Ended.STUCK
        # a step that must be shortened is likely to be shortened again
        far = FAR if number < BENT else 1.0 + 1e-9
        made = _at(stack, point, derivatives=number == 0, limit=far * total)
        if made.cost <= at.cost:
            return made if number == 0 else _at(stack, point)
        if number < BENT and np.isfinite(made.cost):
            point = stack.step(stack.normal(_bent(stack, at, made), at.point), at.point, damping)
            bent = _at(stack, point, derivatives=False, limit=(1.0 + 1e-9) * total)
            if bent.cost <= at.cost:
                return _at(stack, point)
        return made

    return trial


BENT = 2
"""Steps from one point that are bent along the valley before they are shortened."""
FAR = 1e4
"""Times the sum of squares above which a step is not simulated to its end, nor bent."""


def _bent(stack: JointProblem, at: _Stand, there: _Stand) -> tuple[ResidualEvaluation, ...]:
    """Return the evaluations at a point with the residual bent as it was found a step away.

    A valley of two parameters whose sum is known is straight in them, and bent in their logarithms:
    a straight step leaves it at once. What the residual did beyond the derivatives is added, and
    the step made anew follows (Transtrum and Sethna, arXiv 1201.5885, with a whole step for the
    second derivative).
    """
    found = []
    for r, (p, e, beyond) in enumerate(
        zip(stack.problems, at.evaluations, there.evaluations, strict=True)
    ):
        old, new = stack.local(at.point, r), stack.local(there.point, r)
        straight = e.jacobian @ (new.theta - old.theta)
        if p.free_states.size:
            moved = (new.states - old.states)[:, p.free_states]
            for i, (rows, local) in zip(stack.scored(r), e.local, strict=True):
                straight[rows] += local @ moved[i]
        found.append(replace(e, residual=beyond.residual + straight))
    return tuple(found)


def _promised(stack: JointProblem, system: NormalEquations, point: JointPoint) -> float:
    """Return by how much an undamped step lowers the sum of squares, as the derivatives say."""
    return float(system.right @ system.right) - foreseen(stack, system, point)


def foreseen(stack: JointProblem, system: NormalEquations, point: JointPoint) -> float:
    """Return the sum of squares after an undamped step, as the derivatives say."""
    delta = stack.step(system, point, 0.0).theta - point.theta
    after = system.right - system.factor @ delta
    return float(after @ after)


def _at_first(number: int) -> float:
    """Let the states take their whole step once, and then what the parameters' step asks alone.

    Beside a law with kinks theirs may lead away, however small that of the parameters is.
    """
    return float(number == 0)


def _eliminated(stack: JointProblem) -> bool:
    """Whether no model has initial states, or all have eliminated them exactly."""
    return all(p.dynamics.exact_step or not p.free_states.size for p in stack.problems)


def _unstick(stack: JointProblem, at: _Stand) -> _Stand | None:
    """Move initial states on their own, damped, when no joint step lowers the misfit.

    A linear model has nothing to gain: joint steps eliminate its states exactly.
    """
    if _eliminated(stack):
        return None
    states = tuple(
        refine_states(p, stack.local(at.point, r), passes=4).states
        for r, p in enumerate(stack.problems)
    )
    if all(map(np.array_equal, states, at.point.states)):
        return None
    moved = _at(stack, JointPoint(at.point.theta, states))
    return moved if moved.cost < at.cost * (1 - 1e-3) else None
