"""Start values for a plant that runs away: from short windows with initial states of their own."""

from __future__ import annotations

from dataclasses import replace

from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import fit
from identification.study.problem import Problem


def through_windows(problem: Problem, iterations: int) -> Problem:
    """Return the problem with start values fitted on windows; itself where that leads nowhere.

    On windows an error of the start does not add up; judged is the whole record.
    """
    if problem.data.breaks:
        return problem
    train = int(problem.data.mask("train").sum())
    short = replace(
        problem, window=max(100, min(500, train // 20)), known_states={}, initial="free",
        clock=0.0, fixed=(*problem.fixed, *problem.skews),  # clocks reach over the edges
    )  # fmt: skip
    first = bool(problem.data.mask("train")[0])  # then nobody asks where held-out windows begin
    begun = fit(short, max_iterations=iterations, judged=not first)
    if begun.status is FitStatus.BROKEN:
        return problem
    names = problem.engine.state_names
    known = {n: begun.point.states[:1, i] for i, n in enumerate(names)}
    values = {k: v for k, v in begun.values.items() if k in problem.engine.parameters}
    return replace(problem, starts={**problem.starts, **values}, known_states=known)
