"""Where the fit of a law begins: starts worth a fit, a weaker law, the best of them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import Insertion
from identification.estimation.brief import brief, carried
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit, start_cost
from identification.study.problem import Problem
from identification.study.residual import Point, start_point

FIRST = 4
"""Steps of the first round."""


def promising(
    problem: Problem, insertion: Insertion, far: bool = True, plain: float = np.inf
) -> list[Problem]:
    """Return the best starts with the nominal fit's values, and one with the declared ones.

    A large effect may have bent the nominal parameters so far that no path leads back, and initial
    states and offsets with them: a mass that already moves at first does not feel what holds it. If
    no start is any good, one of a weaker law follows the nominal fit's.
    """
    declared = {
        n: p.value
        for n, p in problem.graph.parameters.items()
        if n in problem.starts and not p.fixed and n not in problem.fixed
    }
    fitted = dict(problem.starts)
    chosen: list[Problem] = []
    plainly = (
        problem if problem.source_offsets else replace(problem, known_states={}, known_offsets=())
    )
    groups = [(problem, fitted, 2 if far else 1)]
    # where a whole element is lacking, what is nearest at first is next to none of it
    tried = len(insertion.starts) if insertion.plain else 1
    groups += [(plainly, {**fitted, **declared}, tried)] if far else []
    for posed, base, count in groups:
        begun = [replace(posed, starts={**base, **s}) for s in insertion.starts]
        best = sorted(((misfit_at(p), p) for p in begun), key=lambda b: b[0])[:count]
        chosen += [p for cost, p in best if np.isfinite(cost)]
        if base is fitted and best and best[0][0] > HARM * plain:
            chosen += _weakened(problem, insertion, plain)
    return chosen


def resting(problem: Problem) -> Problem:
    """Return the problem with a start that stays at rest, for a while.

    What a law that jumps holds where a record begins does not feel its own start: a step that is
    made in both leads nowhere.
    """
    return replace(problem, initial=(), known_states={})


def freed(made: Fit, iterations: int) -> Fit:
    """Return a fit that stayed at rest where it began with a free start, if that is as good."""
    if made.problem.initial != () or made.status is FitStatus.BROKEN:
        return made
    free = replace(made.problem, initial="free", correction=None)
    with suppress(BondsightError, np.linalg.LinAlgError, ValueError):
        found = fit(free, start=made.point, max_iterations=iterations)
        if found.status is not FitStatus.BROKEN and found.cost <= (1.0 + ALIKE) * made.cost:
            return found
    return made


ALIKE = 1e-3
"""Part of a misfit that a free start may take more where its descent has ended elsewhere."""


def tells_early(nominal: Fit) -> bool:
    """Whether the first samples have their share of what the model misses."""
    shorter = brief(nominal.problem)
    if shorter is None:
        return False
    train, n = nominal.problem.data.mask("train"), shorter.data.n
    missed = ((nominal.problem.data.readings - nominal.simulated) / nominal.problem.data.floor) ** 2
    return bool(missed[:n][train[:n]].mean() > FAIR * missed[train].mean())


FAIR = 0.5
"""Part of the misfit of a whole record that its first samples have at least, if they tell of it."""


def best_first(starts: Sequence[Problem]) -> list[tuple[Problem, Point | None]]:
    """Fit every start to the first samples; the best comes first, with where it ended."""
    made: list[tuple[Fit, Problem]] = []
    for p in starts if len(starts) > 1 else ():
        shorter = brief(p)
        if shorter is None:
            break
        with suppress(BondsightError, np.linalg.LinAlgError, ValueError):
            found = fit(shorter, max_iterations=FIRST)
            if found.status is not FitStatus.BROKEN and np.isfinite(found.cost):
                made.append((found, p))
    if not made:
        return [(p, None) for p in starts]
    found, best = min(made, key=lambda m: m[0].cost)
    states, at = start_point(best).states, best.free_states
    states[: found.point.states.shape[0], at] = found.point.states[:, at]
    point = Point(carried(found.point.theta, found.problem, best), states)
    return [(best, point), *((p, None) for p in starts if p is not best)]


WEAKER = (0.3, 0.1, 0.03, 0.01, 0.001)
"""Parts of a law's size that are tried where its starts do harm."""
HARM = 2.0
"""Times the misfit without the law from which a start of it does harm."""


def _weakened(problem: Problem, insertion: Insertion, plain: float) -> list[Problem]:
    """Return the strongest law tried that does no harm, beside the nominal fit's values.

    What a weak law would do says the direction; how far it holds, only the model itself. A law so
    weak that it does nothing leads nowhere.
    """
    # what the starts change in the rest of the model was meant for the strong law
    owns = [{n: v for n, v in s.items() if n not in problem.starts} for s in insertion.starts]
    distinct = list({tuple(sorted(own.items())): own for own in owns}.values())
    for share in WEAKER:
        for own in distinct:
            weak = {n: share * v if n in insertion.strengths else v for n, v in own.items()}
            tried = replace(problem, starts={**problem.starts, **weak})
            cost = misfit_at(tried)
            if cost <= HARM * plain and abs(cost - plain) > NOTHING * plain:
                return [tried]
    return []


NOTHING = 1e-6
"""Relative change of the misfit up to which a law does nothing."""


def misfit_at(problem: Problem) -> float:
    """Misfit where a fit of `problem` begins; infinite when it cannot be simulated."""
    try:
        return start_cost(problem)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return np.inf
