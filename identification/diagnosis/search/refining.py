"""Richer laws of effects that are named: tried after the decision, which they leave as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bondgraph.support.errors import BondsightError
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.hypotheses import Scored, Thresholds
from identification.diagnosis.evidence.remaining import remaining
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.base import base_of, unthinned
from identification.diagnosis.search.candidates import (
    Candidate,
    DiagnosisOptions,
    Progress,
    finished,
    fitted_insertions,
    trial_of,
)
from identification.diagnosis.search.scored_laws import scored
from identification.estimation.enough_steps import with_enough_steps
from identification.estimation.single_record import Fit
from identification.study.problem import Problem

__all__ = ["WRITING", "completed", "finely", "refined"]


def completed(
    decisions: tuple[Decision, ...],
    template: Problem,
    options: DiagnosisOptions,
    limits: Thresholds,
    say: Progress,
    stopped: bool = False,
) -> tuple[tuple[Decision, ...], bool]:
    """Fit what was named to all training samples and refine it; says whether that was stopped.

    What was stopped, here or before, is only brought to all samples.
    """
    if not stopped:
        try:
            say("fitting the repaired model on all training samples", 0.899)
            made = refined(unthinned(decisions, template, options.holds), options, limits)
            say("writing up what was found", WRITING)
            return made, False
        except KeyboardInterrupt:
            pass
    say("writing up what was found", WRITING)
    return unthinned(decisions, template), True


WRITING = 0.95
"""Fraction of a diagnosis from which on nobody ends it in good time."""


def finely(
    decisions: tuple[Decision, ...], kind: str, nominal: Fit
) -> tuple[tuple[Decision, ...], Fit, str]:
    """Give the numbers of the answer the sub-steps that their intervals ask for; it stays.

    Those of the repaired model, or of the model as it is where it explains the recording. Returns
    the decisions, the model as it is, and a line where the steps would be too many.
    """
    try:
        if kind in ("explained", "parameters_only"):
            return decisions, *with_enough_steps(nominal)
        named = [i for i, d in enumerate(decisions) if d.kind == kind == "missing_physics"]
        chosen = decisions[named[-1]].chosen if named else None
        if chosen is None:
            return decisions, nominal, ""
        fit, said = with_enough_steps(chosen.fit)
    except (KeyboardInterrupt, BondsightError, np.linalg.LinAlgError):
        return decisions, nominal, ""
    made = list(decisions)
    made[named[-1]] = replace(made[named[-1]], chosen=trial_of(chosen.insertion, chosen.home, fit))
    return tuple(made), nominal, said


def refined(
    decisions: Sequence[Decision], options: DiagnosisOptions, limits: Thresholds
) -> tuple[Decision, ...]:
    """Return decisions whose repaired model has the richer laws that it surely needs.

    Kind, name, place and every other answer stay; laws, fits and words change. Only an effect that
    was named for what the first one's plain law leaves is taken back.
    """
    made = _without_own_rest(list(decisions), options, limits)
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


def _without_own_rest(
    made: list[Decision], options: DiagnosisOptions, limits: Thresholds
) -> list[Decision]:
    """Take back what was named after the first effect, if its richer law leaves noise alone.

    And predicts stretches left out no worse than all that was named: a rest of a law is no effect.
    """
    named = [d for d in made if d.kind == "missing_physics" and d.chosen is not None]
    if len(named) < 2 or named[0].chosen is None or named[-1].chosen is None:
        return made
    first, last = named[0].chosen, named[-1].chosen
    found = _needed(first, first, options, limits)
    if found is None or found.left.most > limits.noise:
        return made
    (whole,) = scored([last])
    if found.score.behind(whole.score) >= limits.z:
        return made
    taken = ", ".join(d.chosen.label for d in named[1:] if d.chosen is not None)
    reason = f"{taken}: its own richer law explains as well what {first.label} left"
    quiet = replace(
        made[-1], kind="explained", chosen=None, same_place=(), rivals=(), richer=(), share=0.0,
        confidence=0.0, reasons=(reason,), remaining=found.left, answer="unknown", physics="",
        places=(), law_fit=float("nan"), kinds=(),
    )  # fmt: skip
    return [*made[: made.index(named[0]) + 1], quiet]


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
