"""Start values for a plant that runs away: from short windows with initial states of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.diagnosis.catalogue.effect import Insertion
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import fit
from identification.estimation.sub_steps import coarse
from identification.study.problem import Problem
from identification.study.residual import windows


def through_windows(
    problem: Problem, iterations: int, insertion: Insertion | None = None
) -> Problem:
    """Return the problem with start values fitted on windows; itself where that leads nowhere.

    On windows no error of the start adds up, and none of the sub-steps; judged is the whole record.
    Where they begin is asked of the model without the law of an `insertion` first: a law along the
    way has to know which part of the way.
    """
    if problem.data.breaks:
        return problem
    train = int(problem.data.mask("train").sum())
    short = replace(
        problem, window=max(100, min(500, train // 20)), known_states={}, initial="free",
        clock=0.0, correction=None,
        fixed=(*problem.fixed, *problem.skews),  # clocks reach over the edges
    )  # fmt: skip
    first = bool(problem.data.mask("train")[0])  # then nobody asks where held-out windows begin
    if insertion is not None:
        short = _placed(coarse(short), insertion)
    begun = fit(coarse(short), max_iterations=iterations, judged=not first)
    if begun.status is FitStatus.BROKEN:
        return problem
    names = problem.dynamics.state_names
    known = {n: begun.point.states[:1, i] for i, n in enumerate(names)}
    begin, whole = windows(short)[0].start, windows(problem)[0].start
    for n, course in (insertion.courses if insertion is not None else {}).items():
        if n in known:
            known[n] = known[n] - (course[begin] - course[whole])
    values = {k: v for k, v in begun.values.items() if k in problem.dynamics.parameters}
    return replace(problem, starts={**problem.starts, **values}, known_states=known)


def _placed(short: Problem, insertion: Insertion) -> Problem:
    """Return the problem with windows that begin where the readings are.

    Of a state that no reading tells, where its course was.
    """
    weak = {**short.starts, **dict.fromkeys(insertion.strengths, 0.0)}
    plain = replace(short, starts=weak, fixed=(*short.fixed, *short.graph.parameters))
    found = fit(plain, max_iterations=FEW, judged=False)
    if found.status is FitStatus.BROKEN:
        return short
    names = plain.dynamics.state_names
    known = {n: found.point.states[:, i] for i, n in enumerate(names)}
    begin = [w.start for w in windows(short)]
    for n, course in insertion.courses.items():
        if n in known and not np.ptp(known[n]):
            known[n] = course[begin]
    return replace(short, known_states=known)


FEW = 6
"""Steps that find where windows begin: one where the model is linear."""
