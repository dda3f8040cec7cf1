"""Fits with many sub-steps at the price of few: deferred correction.

Most of a fit's time goes into derivatives, and they need far fewer sub-steps than the readings do.
So the descent runs with few, beside the readings' difference to many at a point passed before, and
the difference is taken anew until the misfit with many agrees (Stetter, Numer. Math. 29 (1978)
425). How many are enough, a search asks beside the noise of a sample, and an estimate beside the
standard errors of the unknowns (`moves`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import final

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit
from identification.study.problem import Problem
from identification.study.residual import LOCATED, Point, ResidualEvaluation, evaluate, start_point

PASSES = 6
"""Corrections at the most; one that is small is right after two."""
LARGEST = 0.02
"""Share of a reading's range that a correction may have: beyond it derivatives are wrong, too."""
AGREES = 1e-4
"""Relative difference of the two misfits up to which nothing is left to correct."""
NEAR = 1.05
"""Times a misfit up to which a correction has held to the end of a descent."""


def fit_from(problem: Problem, start: Point, iterations: int) -> Fit:
    """Fit from a point, with derivatives of as few sub-steps as one correction makes up for.

    Where the corrections do not settle (a switching that every step places anew), the fit goes on
    with derivatives of all sub-steps.

    Parameters
    ----------
    iterations : int
        Of each descent between two corrections.
    """
    if problem.n_sub == 1 or problem.exact:
        return fit(problem, start=start, max_iterations=iterations)
    problem = replace(problem, correction=None, built=problem.dynamics)
    there = evaluate(problem, start, derivatives=False)
    few, point, cost = with_few(problem, start, there), start, there.cost
    for _ in range(PASSES):
        if few is None or not np.isfinite(cost):
            break
        made = fit(few, start=point, max_iterations=iterations)
        if made.status is FitStatus.BROKEN:
            break
        there = evaluate(problem, made.point, derivatives=False)
        new = there.cost
        if not new <= (1.0 + AGREES) * cost:
            break
        point, cost = made.point, new
        if abs(new - made.cost) <= AGREES * new:
            return replace(made, problem=problem, cost=cost, simulated=there.y)
        few = corrected(few, made.simulated, there.y)
    return fit(problem, start=point, max_iterations=iterations)


def tried_from(problem: Problem, start: Point, iterations: int) -> Fit:
    """Go a few steps from a point, with one correction: enough to see whether it leads anywhere."""
    problem = replace(problem, correction=None, built=problem.dynamics)
    few = None
    if problem.n_sub > 1 and not problem.exact:
        few = with_few(problem, start, evaluate(problem, start, derivatives=False))
    return fit(few or problem, start=start, max_iterations=iterations, judged=False)


def begun_from(problem: Problem, start: Point, iterations: int) -> Fit:
    """Go a few steps from a point as `tried_from`; what is said of it is of all sub-steps.

    Where the correction does not hold to the end it is taken anew; only where that leads nowhere
    all steps are taken with all sub-steps. Held-out windows are not judged.
    """
    problem = replace(problem, correction=None, built=problem.dynamics)
    few, first, best = None, np.inf, None
    if problem.n_sub > 1 and not problem.exact:
        there = evaluate(problem, start, derivatives=False)
        few, first = with_few(problem, start, there), there.cost
    made = fit(few or problem, start=start, max_iterations=iterations, judged=False)
    if few is None:
        return made
    for again in range(ANEW):
        if again:
            made = fit(few, start=made.point, max_iterations=iterations, judged=False)
        if made.status is FitStatus.BROKEN:
            break
        there = evaluate(problem, made.point, derivatives=False)
        reached = replace(made, problem=problem, cost=there.cost, simulated=there.y)
        if best is None or there.cost < best.cost:
            best = reached
        if abs(there.cost - made.cost) <= (NEAR - 1.0) * made.cost:
            return reached
        few = corrected(few, made.simulated, there.y)
    if best is not None and best.cost < first:
        if not problem.dynamics.jumps:
            return best
        start = best.point  # few derivatives misplace a jump: only those of all steps lead on
    return fit(problem, start=start, max_iterations=iterations, judged=False)


ANEW = 3
"""Descents of a beginning at the most, each beside a correction of its own."""


def with_few(
    problem: Problem, point: Point, there: ResidualEvaluation, least: int = 1
) -> Problem | None:
    """Return the problem with fewer sub-steps, corrected at a point; None if that is too coarse.

    Parameters
    ----------
    there : ResidualEvaluation
        Of `problem` at `point`.
    least : int
        Sub-steps that are taken at least.
    """
    n_sub = max(least, replace(problem, n_sub=1).steps)
    while n_sub < problem.n_sub:
        few = replace(problem, n_sub=n_sub, correction=None)
        few = corrected(few, evaluate(few, point, derivatives=False).y, there.y)
        if small_correction(few):
            return few
        n_sub *= 2
    return None


def coarse(problem: Problem) -> Problem:
    """Return the problem with as few sub-steps as its start needs: enough to find a better one."""
    return problem if (few := _few_at_start(problem)) is None else replace(few, correction=None)


def eased(problem: Problem) -> Problem:
    """Return a problem of many sub-steps with a part of them, corrected where it starts.

    Whatever is tried beside its law begins with the errors of that law made up for.
    """
    least = problem.n_sub // EASED
    # what is followed to a jump costs more than its few sub-steps say
    worth = least > 1 or (problem.dynamics.jumps and problem.n_sub >= LOCATED)
    few = _few_at_start(problem, max(1, least)) if worth else None
    return problem if few is None else few


EASED = 8
"""Part of the sub-steps with which laws are tried beside those that need many."""


def _few_at_start(problem: Problem, least: int = 1) -> Problem | None:
    if problem.n_sub == 1 or problem.exact:
        return None
    problem = replace(problem, correction=None, built=problem.dynamics)
    point = start_point(problem)
    return with_few(problem, point, evaluate(problem, point, derivatives=False), least)


def corrected(few: Problem, simulated: Array, whole: Array) -> Problem:
    """Return a problem whose readings are those of more sub-steps at one point.

    Parameters
    ----------
    simulated : ndarray, shape (N, n_y), SI
        Readings of `few`, with the correction that it has.
    whole : ndarray, shape (N, n_y), SI
        Those of more sub-steps.
    """
    bare = simulated if few.correction is None else simulated - few.correction
    return replace(few, correction=whole - bare, known_scale=few.state_scale)


def small_correction(problem: Problem) -> bool:
    """Whether readings change by little with more sub-steps: else derivatives are wrong, too."""
    assert problem.correction is not None
    train = problem.data.mask("train")
    most = np.maximum(LARGEST * np.ptp(problem.data.readings[train], axis=0), problem.data.floor)
    moved = problem.correction[train]
    return bool(np.isfinite(moved).all() and (np.abs(moved).max(axis=0) <= most).all())


@final
class Refinement:
    """Readings at a point by the number of sub-steps, without any correction; each is run once.

    Parameters
    ----------
    simulated : ResidualEvaluation, optional
        Of `problem`, if it is known and has no correction.
    """

    def __init__(
        self, problem: Problem, point: Point, simulated: ResidualEvaluation | None = None
    ) -> None:
        self._problem = replace(problem, correction=None, built=problem.dynamics)
        self._point = point
        self._runs = {} if simulated is None else {problem.n_sub: simulated}

    def run(self, n: int) -> ResidualEvaluation:
        """Return the readings with `n` sub-steps."""
        if n not in self._runs:
            problem = replace(self._problem, n_sub=n)
            self._runs[n] = evaluate(problem, self._point, derivatives=False)
        return self._runs[n]

    def foretold(self, n: int) -> ResidualEvaluation:
        """Return what `n` sub-steps and half as many say of infinitely many.

        Beside a law that jumps nothing foretells the error, which has either sign.
        """
        whole, half, jumps = self.run(n), self.run(n // 2), self._problem.dynamics.jumps
        ahead = 0.0 if jumps else still_to_come(jumps)
        return replace(
            whole,
            y=whole.y + ahead * (whole.y - half.y),
            residual=whole.residual + ahead * (whole.residual - half.residual),
        )


def fewest(begin: int, most: int, enough: Callable[[int], bool]) -> int:
    """Return the first of `begin`, twice, four times as many that is enough, or else the last."""
    n = begin
    while n < most and not enough(n):
        n *= 2
    return n


def still_to_come(jumps: bool) -> float:
    """Return the share of the change by twice the sub-steps that all further ones bring.

    The linear interpolation of inputs and deviations within a step makes an error of second order,
    so that a third of the change from half as many is still to come (Richardson). Beside a law that
    jumps the error is of first order and of either sign: as much may come.
    """
    return 1.0 if jumps else 1.0 / 3.0


LEAST, FINEST = 16, 64
"""Sub-steps of a sample up to which a fit is refined, in a long record and in a short one."""
IN_ALL = 2**19
"""Sub-steps of a whole record up to which more than the least are worth their time."""


def finest_of(samples: int, finest: int = FINEST, least: int = LEAST, in_all: int = IN_ALL) -> int:
    """Return the sub-steps of a sample up to which a fit of a record is refined."""
    while finest > least and finest * samples > in_all:
        finest //= 2
    return finest


def settled_fit(
    problem: Problem, iterations: int, start: Point | None = None, finest: int | None = None
) -> Fit:
    """Fit, then refine the sub-steps until they no longer matter beside the residual."""
    if start is None:
        return refined(fit(problem, max_iterations=iterations), iterations, finest)
    return refined(fit_from(problem, start, iterations), iterations, finest)


def refined(result: Fit, iterations: int, finest: int | None = None) -> Fit:
    """Refine the sub-steps of a fit until they no longer matter beside the residual."""
    problem = result.problem
    finest = finest_of(problem.data.n) if finest is None else finest
    if problem.exact:
        return result
    while result.status is not FitStatus.BROKEN:
        enough = _enough(result, finest)
        if enough == result.problem.n_sub:
            break
        finer = replace(result.problem, n_sub=enough, built=problem.dynamics)
        result = fit_from(finer, result.point, iterations)
    return result


def _enough(result: Fit, finest: int) -> int:
    """Return the sub-steps of which twice as many change next to nothing where a fit ended."""
    problem, begin = result.problem, result.problem.steps
    steps = Refinement(problem, result.point)
    m = problem.data.mask("train") | problem.data.mask("test")

    def enough(n: int) -> bool:
        before = result.simulated if n == begin else steps.run(n).y
        change = (steps.run(2 * n).y - before)[m] / problem.data.floor
        moved = float(np.mean(change**2))
        return not np.isfinite(moved) or moved < 0.02 * max(1.0, result.cost)

    count = fewest(begin, finest, enough)
    return problem.n_sub if count == begin else count
