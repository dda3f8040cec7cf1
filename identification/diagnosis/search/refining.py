"""Richer laws of effects that are named: tried after the decision, which they leave as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.hypotheses import Scored, Thresholds
from identification.diagnosis.evidence.remaining import remaining
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.base import base_of
from identification.diagnosis.search.candidates import (
    Candidate,
    DiagnosisOptions,
    finished,
    fitted_insertions,
    trial_of,
)
from identification.diagnosis.search.one_step import scored

__all__ = ["refined"]


def refined(
    decisions: Sequence[Decision], options: DiagnosisOptions, limits: Thresholds
) -> tuple[Decision, ...]:
    """Return decisions whose repaired model has the richer laws that it surely needs.

    Kind, name, place and every other answer stay; laws, fits and words change.
    """
    made = list(decisions)
    named = [i for i, d in enumerate(made) if d.kind == "missing_physics" and d.chosen is not None]
    for i in named:
        own, last = made[i].chosen, made[named[-1]].chosen
        assert own is not None
        assert last is not None
        found = _needed(own, last, options, limits)
        if found is None:
            continue
        made[i] = replace(made[i], chosen=replace(own, insertion=found.trial.insertion))
        last = made[named[-1]].chosen
        assert last is not None
        whole = trial_of(last.insertion, last.home, found.trial.fit)
        made[named[-1]] = replace(made[named[-1]], chosen=whole, remaining=found.left)
    return tuple(made)


def _needed(
    own: Candidate, last: Candidate, options: DiagnosisOptions, limits: Thresholds
) -> Scored | None:
    """Return the best richer law of `own` in the last model, where it is surely needed.

    Something above the noise is left; stretches left out are predicted better by more than the
    limit of a name, held-out samples better too, and its strengths do not vanish.
    """
    fit, left = last.fit, remaining(last.fit)
    if (
        own.insertion.form
        or left.most <= limits.noise
        or own.element not in fit.problem.graph.elements
    ):
        return None
    effect = next(e for e in options.catalogue if e.name == own.effect)
    seen = scene(fit)
    richer = effect.refinements(seen, seen.graph[own.element], fit.values)
    if not richer:
        return None
    template = base_of(fit).template
    tried = fitted_insertions(
        seen, template, [(r, own.home) for r in richer], options, beat=last.train
    )
    plain, *_ = scored([last])
    better = [
        s for s in scored(finished(tried, options), options.jobs)
        if plain.score.behind(s.score) > limits.z and s.trial.test < last.test and s.trial.itself
        and _shows(s.trial)
    ]  # fmt: skip
    return min(better, key=lambda s: s.score.loss, default=None)


def _shows(trial: Candidate) -> bool:
    """Whether zero is outside the interval of every strength."""
    ends = [e.ci95 for e in trial.fit.estimates if e.name in trial.insertion.strengths]
    return bool(ends) and all(low > 0.0 or high < 0.0 for low, high in ends)
