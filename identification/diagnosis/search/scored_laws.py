"""Scores of fitted laws, and which of them have a part of their own that may be zero."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from joblib import Parallel, delayed

from identification.diagnosis.evidence.block_score import score
from identification.diagnosis.evidence.hypotheses import Scored
from identification.diagnosis.evidence.remaining import remaining
from identification.diagnosis.search.candidates import Candidate
from identification.estimation.single_record import Fit


def scored(trials: Sequence[Candidate], jobs: int = 1) -> tuple[Scored, ...]:
    """Score candidates in `jobs` threads, best first."""
    made = Parallel(n_jobs=jobs, backend="threading")(delayed(_scored)(t) for t in trials)
    laws = sorted(made, key=lambda s: s.score.loss)
    return tuple(
        replace(s, idle=s.score.behind(laws[0].score) < NEAR and _idle(s.trial, trials))
        for s in laws
    )


NEAR = 3.0
"""Standard errors behind the best up to which a law's own part is looked at."""


def _idle(trial: Candidate, trials: Sequence[Candidate]) -> bool:
    """Whether all strengths that a simpler law there does not have may be zero.

    Where those of the simpler law may be zero as well, all numbers share a scale that the readings
    do not tell: then their intervals say nothing of what is needed.
    """
    simpler = [
        t for t in trials
        if trial.insertion.contains(t.insertion)
    ]  # fmt: skip
    if not simpler:
        return False
    known = simpler[0].fit.problem.graph.parameters
    own = [n for n in trial.insertion.strengths if n not in known]
    return may_vanish(trial.fit, own) and not may_vanish(
        simpler[0].fit, simpler[0].insertion.strengths
    )


def may_vanish(fit: Fit, strengths: Collection[str]) -> bool:
    """Whether zero lies in the interval of every one of some strengths."""
    ends = [e.ci95 for e in fit.estimates if e.name in strengths]
    return bool(ends) and all(low <= 0.0 <= high for low, high in ends)


def _scored(trial: Candidate) -> Scored:
    return Scored(trial, score(trial.fit), remaining(trial.fit))
