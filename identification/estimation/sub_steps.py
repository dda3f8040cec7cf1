"""Fits with many sub-steps at the price of few: deferred correction.

Most of a fit's time goes into derivatives, and they need far fewer sub-steps than the readings do.
So the descent runs with few, beside the readings' difference to many at a point passed before, and
the difference is taken anew until the misfit with many agrees (Stetter, Numer. Math. 29 (1978)
425).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit
from identification.study.problem import Problem
from identification.study.residual import Point, ResidualEvaluation, evaluate

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
    problem = replace(problem, correction=None, built=problem.engine)
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
        assert few.correction is not None
        change = there.y - (made.simulated - few.correction)
        few = replace(few, correction=change, known_scale=few.state_scale)
    return fit(problem, start=point, max_iterations=iterations)


def tried_from(problem: Problem, start: Point, iterations: int) -> Fit:
    """Go a few steps from a point, with one correction: enough to see whether it leads anywhere."""
    problem = replace(problem, correction=None, built=problem.engine)
    few = None
    if problem.n_sub > 1 and not problem.exact:
        few = with_few(problem, start, evaluate(problem, start, derivatives=False))
    return fit(few or problem, start=start, max_iterations=iterations, judged=False)


def begun_from(problem: Problem, start: Point, iterations: int) -> Fit:
    """Go a few steps from a point as `tried_from`; what is said of it is of all sub-steps.

    Where the correction does not hold to the end, all steps are taken with all sub-steps. Held-out
    windows are not judged.
    """
    made = tried_from(problem, start, iterations)
    if made.problem.correction is None:
        return made
    there = evaluate(problem, made.point, derivatives=False)
    cost = there.cost
    if not abs(cost - made.cost) <= (NEAR - 1.0) * made.cost:
        return fit(problem, start=start, max_iterations=iterations, judged=False)
    return replace(made, problem=problem, cost=cost, simulated=there.y)


def with_few(problem: Problem, point: Point, there: ResidualEvaluation) -> Problem | None:
    """Return the problem with fewer sub-steps, corrected at a point; None if that is too coarse.

    Parameters
    ----------
    there : ResidualEvaluation
        Of `problem` at `point`.
    """
    n_sub = replace(problem, n_sub=1).steps
    while n_sub < problem.n_sub:
        few = replace(problem, n_sub=n_sub, correction=None)
        change = there.y - evaluate(few, point, derivatives=False).y
        if small_correction(change, problem):
            return replace(few, correction=change)
        n_sub *= 2
    return None


def small_correction(change: Array, problem: Problem) -> bool:
    """Whether readings change by little with more sub-steps: else derivatives are wrong, too.

    Parameters
    ----------
    change : ndarray, shape (N, n_y), SI
    """
    train = problem.data.mask("train")
    most = np.maximum(LARGEST * np.ptp(problem.data.readings[train], axis=0), problem.data.floor)
    moved = change[train]
    return bool(np.isfinite(moved).all() and (np.abs(moved).max(axis=0) <= most).all())


LEAST, FINEST = 16, 64
"""Sub-steps of a sample up to which a fit is refined, in a long record and in a short one."""
IN_ALL = 2**19
"""Sub-steps of a whole record up to which more than the least are worth their time."""


def finest_of(samples: int) -> int:
    """Return the sub-steps of a sample up to which a fit of a record is refined."""
    finest = FINEST
    while finest > LEAST and finest * samples > IN_ALL:
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
        finer = replace(result.problem, n_sub=enough, built=problem.engine)
        result = fit_from(finer, result.point, iterations)
    return result


def _enough(result: Fit, finest: int) -> int:
    """Return the sub-steps of which twice as many change next to nothing where a fit ended."""
    problem, before = result.problem, result.simulated
    m = problem.data.mask("train") | problem.data.mask("test")
    count = begin = problem.steps
    while count < finest:
        finer = replace(problem, n_sub=2 * count, built=problem.engine)
        after = evaluate(finer, result.point, derivatives=False).y
        change = float(np.mean(((after - before)[m] / problem.data.floor) ** 2))
        if not np.isfinite(change) or change < 0.02 * max(1.0, result.cost):
            break
        count, before = 2 * count, after
    return problem.n_sub if count == begin else count
