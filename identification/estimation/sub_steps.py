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
from identification.estimation.single_record import Fit, FitStatus, fit
from identification.study.problem import Problem
from identification.study.residual import Point, ResidualEvaluation, evaluate

PASSES = 6
"""Corrections at the most; one that is small is right after two."""
LARGEST = 0.02
"""Share of a reading's range that a correction may have: beyond it derivatives are wrong, too."""
AGREES = 1e-4
"""Relative difference of the two misfits up to which nothing is left to correct."""
NEAR, FAR = 1.05, 2.0
"""Times a misfit to beat from which a descent that has ended, or has only begun, will not."""


def fit_from(problem: Problem, start: Point, iterations: int, beat: float = np.inf) -> Fit:
    """Fit from a point, with derivatives of as few sub-steps as one correction makes up for.

    Where the corrections do not settle (a switching that every step places anew), the fit goes on
    with derivatives of all sub-steps.

    Parameters
    ----------
    iterations : int
        Of each descent between two corrections.
    beat : float
        Misfit above which the result is of no use: the descent ends where it will not get there.
    """
    exact = problem.engine.exact_step and problem.data.hold != "band-limited"
    if problem.n_sub == 1 or exact:
        return fit(problem, start=start, max_iterations=iterations)
    problem = replace(problem, correction=None, built=problem.engine)
    there = evaluate(problem, start, derivatives=False)
    few, point, cost = with_few(problem, start, there), start, _cost(there)
    for _ in range(PASSES):
        if few is None or not np.isfinite(cost):
            break
        made = fit(few, start=point, max_iterations=iterations)
        if made.status is FitStatus.BROKEN:
            break
        there = evaluate(problem, made.point, derivatives=False)
        new = _cost(there)
        if not new <= (1.0 + AGREES) * cost:
            break
        point, cost = made.point, new
        ended = made.status is not FitStatus.ITERATIONS
        hopeless = new > (NEAR if ended else FAR) * beat
        if hopeless or abs(new - made.cost) <= AGREES * new:
            status = FitStatus.ITERATIONS if hopeless else made.status
            return replace(made, problem=problem, cost=cost, simulated=there.y, status=status)
        assert few.correction is not None
        change = there.y - (made.simulated - few.correction)
        few = replace(few, correction=change)
    return fit(problem, start=point, max_iterations=iterations)


def held_otherwise(result: Fit, hold: str, iterations: int) -> Fit:
    """Fit a few steps from where `result` ended, with commands that behave otherwise in between.

    What the sub-steps correct is taken from `result`, so that the descent needs few of them.
    """
    problem = result.problem
    least = 2 if hold == "band-limited" else 1
    exact = problem.engine.exact_step and problem.data.hold != "band-limited"
    few = None
    # between samples, a correction of band-limited commands would be the behaviour itself
    if problem.n_sub > least and not exact and problem.data.hold != "band-limited":
        plain = replace(problem, correction=None, built=problem.engine)
        there = evaluate(plain, result.point, derivatives=False)
        few = with_few(plain, result.point, there, least)
    few = few or replace(problem, n_sub=max(problem.n_sub, least), built=problem.engine)
    other = replace(few, data=replace(problem.data, hold=hold))
    return fit(other, start=result.point, max_iterations=iterations)


def with_few(
    problem: Problem, point: Point, there: ResidualEvaluation, least: int = 1
) -> Problem | None:
    """Return the problem with fewer sub-steps, corrected at a point; None if that is too coarse.

    Parameters
    ----------
    there : ResidualEvaluation
        Of `problem` at `point`.
    least : int
        Sub-steps at the least.
    """
    train = problem.data.mask("train")
    most = np.maximum(LARGEST * np.ptp(problem.data.readings[train], axis=0), problem.data.floor)
    n_sub = replace(problem, n_sub=least).steps
    while n_sub < problem.n_sub:
        few = replace(problem, n_sub=n_sub, correction=None)
        change = there.y - evaluate(few, point, derivatives=False).y
        if _small(change[train], most):
            return replace(few, correction=change)
        n_sub *= 2
    return None


def _small(change: Array, most: Array) -> bool:
    return bool(np.isfinite(change).all() and (np.abs(change).max(axis=0) <= most).all())


def _cost(e: ResidualEvaluation) -> float:
    return float(np.mean(e.residual**2)) if e.residual.size else np.inf
