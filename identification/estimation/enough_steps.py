"""A fit with as many sub-steps as its intervals ask for, and what is said where they are too many.

A search refines sub-steps until they no longer matter beside the noise of a sample. A misfit that
all samples share counts with the root of their number, and may move a value by several of its
standard errors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.moves import BIAS, moves_at
from identification.estimation.single_record import Fit, alone
from identification.estimation.sub_steps import (
    IN_ALL,
    Refinement,
    finest_of,
    fit_from,
    still_to_come,
)
from identification.study.problem import Problem

MOST = 256
"""Sub-steps of a sample at the most."""
DEARER = 16
"""Times the price of a step where no linear model with scalar laws is stepped exactly."""
ITERATIONS = 25
PASSES = 3
FAR = 10.0
"""Standard errors from which the steps that are enough are judged again where a fit has ended."""
SURELY = 10.0
"""Sum of squares by which more sub-steps surely fit worse."""
WORSE = (
    "more than {n} sub-steps a sample fit worse, as they do where a recording was simulated in "
    "few steps or a law is slightly wrong: the numbers are those of {n}"
)
WORTH = 1.0
"""Standard errors of a bias from which it is worth a word."""


@dataclass(frozen=True, eq=False)
class Bias:
    """What the size of the sub-steps still does to the values of a fit.

    Attributes
    ----------
    enough : int
        Sub-steps of which twice as many move no value by much, or the most that are taken.
    left : float
        Standard errors by which `enough` leave the unknown `name` off.
    error : ndarray
        Standard errors of the scaled unknowns.
    """

    enough: int
    left: float
    name: str
    error: Array


def with_enough_steps(made: Fit) -> tuple[Fit, str]:
    """Refit with sub-steps that bias no value by more than a fifth of its standard error.

    Returns the fit, and a line where that would take too many. A fit that does not come to an end
    with more sub-steps, or fits worse, stays as it is.
    """
    if made.problem.exact or made.status is FitStatus.BROKEN:
        return made, ""
    for _ in range(PASSES):
        bias = _bias(made)
        if bias is None or bias.enough <= made.problem.n_sub:
            return made, _words(made, bias)
        finer = replace(made.problem, n_sub=bias.enough, built=made.problem.dynamics)
        again = fit_from(finer, made.point, ITERATIONS)
        if again.status is FitStatus.BROKEN or not np.isfinite(again.cost):
            return made, ""
        if _worse(again, made):
            return made, WORSE.format(n=made.problem.n_sub)
        far = np.abs((again.point.theta - made.point.theta) / bias.error).max(initial=0.0)
        made = again
        if far < FAR:
            return made, _words(made, bias)
    return made, _words(made, _bias(made))


def _worse(finer: Fit, made: Fit) -> bool:
    """Whether finer steps lose what the numbers of coarser ones have gained."""
    rows = int(made.problem.data.mask("train").sum()) * len(made.problem.data.names)
    return rows * (finer.cost - made.cost) > SURELY * max(1.0, made.cost)


def _words(made: Fit, bias: Bias | None) -> str:
    if bias is None or bias.left < WORTH:
        return ""
    jumps = made.problem.dynamics.jumps
    cure = "sample faster" if jumps else "estimate(found.study.changed(n_sub=None)) corrects it"
    return (
        f"{made.problem.n_sub} sub-steps a sample may leave {bias.name} off by {bias.left:.2g} "
        f"standard errors, and more would take too long: its interval is too narrow; {cure}"
    )


def _bias(made: Fit) -> Bias | None:
    """Return how many sub-steps are enough at the point of a fit; None where it tells nothing."""
    problem, (stack, point) = made.problem, alone(made)
    now = stack.evaluate(point)
    moves = moves_at(stack, now, point)
    if moves is None:
        return None

    def moved(change: Array) -> tuple[float, str]:
        by = moves.by(change)
        at = int(np.argmax(by))
        return float(by[at]), stack.names[at]

    steps = Refinement(problem, made.point, now[0])
    ahead = still_to_come(problem.dynamics.jumps)
    n = problem.n_sub
    most = max(n, _most(problem))
    while True:
        after = steps.run(2 * n).residual
        if not np.isfinite(after).all():
            return None
        change, name = moved(after - steps.run(n).residual)
        if (1.0 + ahead) * change < BIAS or n >= most:
            return Bias(n, (1.0 + ahead) * change, name, moves.error)
        n *= 2
        if ahead * change < BIAS:
            return Bias(n, ahead * change, name, moves.error)


def _most(problem: Problem) -> int:
    """Return the sub-steps of a sample that are worth their time in a record of this length."""
    if problem.dynamics.lure is not None:
        return finest_of(problem.data.n, MOST)
    return finest_of(problem.data.n, MOST, 1, IN_ALL // DEARER)
