"""Richer forms of a law that explains much, but not all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.catalogue.effect import Effect, Insertion
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.decision import MOSTLY
from identification.diagnosis.evidence.hypotheses import Evidence, Scored, Thresholds
from identification.diagnosis.evidence.kinds_told import CURVES, RICHER
from identification.diagnosis.search.candidates import Candidate, finished, fitted_insertions
from identification.diagnosis.search.scored_laws import may_vanish, scored
from identification.diagnosis.search.task import Searched, SearchTask, told_within


def with_forms(
    found: Searched, task: SearchTask, evidence: Evidence, decision: Decision
) -> Evidence:
    """Fit richer forms of a law that explains much, but not all.

    Of all laws that explain nearly what the best does, or much where the best leaves much; where
    nothing can be named, half of it, and at first also forms that need no simpler law to begin
    from: what is large and softens or hardens bends the model until no simple law does anything. A
    form takes the place of its law only where held-out samples and the stretches left out are both
    surely better with it than with any law, and little is left; beside a name only noise: what is
    missing elsewhere may not be made part of a name. Forms that the data do not tell from it come
    along. Where a kind is told, a form has to be of that kind.
    """
    unknown = decision.kind == "unknown_physics"
    named = [s for s in evidence.laws if s.trial.effect != UNNAMED.name and s.trial.itself]
    if not named or named[0].left.most <= task.limits.noise:
        return evidence
    best, plain = named[0], evidence.plain
    most, excess = gained(best, plain), plain.square - 1.0
    least = MUCH * most if unknown else MUCH * excess
    if not unknown and best.left.most < LOUD:
        least = max(least, NEARLY * most)
    made: dict[tuple[str, object], list[tuple[Insertion, bool]]] = {}
    for s in named if most > 0 else ():
        effect = next(e for e in found.options.catalogue if e.name == s.trial.effect)
        at = (s.element, effect.richer or effect.name)  # laws of friction share their forms
        if at not in made and gained(s, plain) >= least:
            made[at] = _forms_of(effect, s.element, named, found)
    for r in found.ranked if unknown and found.number == 0 else ():
        at = (r.element.name, r.effect.richer)
        if r.effect.richer and r.home and at not in made:
            made[at] = _forms_of(r.effect, r.element.name, (), found)
    every = [
        (f, home) for forms in made.values() for f, home in forms
        if f.starts and of_told_kind(f, decision)
    ]  # fmt: skip
    forms = _fitted_forms(every, best, found, task) if every else ()
    form = best_form(forms, best, task.limits)
    if form is None or not (unknown or form.left.most <= task.limits.noise):
        form, forms = best, tuple(f for f in forms if f.trial.effect == best.trial.effect)
    alike = [f for f in forms if f.trial.itself and f.score.behind(form.score) < task.limits.z]
    laws: dict[tuple[str, str], Scored] = {}
    for law in (form, *sorted(alike, key=lambda o: o.score.loss), *evidence.laws):
        laws.setdefault((law.trial.effect, law.element), law)
    return replace(evidence, laws=tuple(sorted(laws.values(), key=lambda o: o.score.loss)))


def of_told_kind(form: Insertion, decision: Decision) -> bool:
    """Whether a form may be what a decision has told: of its kind, or one that holds the other.

    A surface of displacement and flow at a place is no memory there, nor the other way round.
    """
    told = {k.kind for k in decision.kinds} if decision.answer == "kind" else {form.kind}
    return form.kind in told or bool(told & CURVES if form.kind in RICHER else told & set(RICHER))


def _forms_of(
    effect: Effect, place: str, named: Sequence[Scored], found: Searched
) -> list[tuple[Insertion, bool]]:
    """Return richer forms of an effect, which start where the laws at its place ended.

    Each with whether its place is a usual one.
    """
    ended = {o.trial.effect: o.trial.fit.values for o in named if o.element == place}
    element = found.seen.graph[place]
    return [(f, effect.home(element)) for f in effect.forms(found.seen, element, ended)]


def _fitted_forms(
    made: Sequence[tuple[Insertion, bool]], best: Scored, found: Searched, task: SearchTask
) -> tuple[Scored, ...]:
    """Fit forms as the best law was; those that fit better than it are scored."""
    options, template = found.options, found.base.template
    template = replace(template, data=replace(template.data, hold=best.trial.fit.problem.data.hold))
    say = told_within(task, found.number)
    tried = fitted_insertions(
        found.seen, template, made, options, say, 0.95, 0.98, best.trial.train
    )
    tried = [t for t in tried if t.train < AS_GOOD * best.trial.train]
    borne = [(t, less) for t in tried if (less := _without_zeros(t, found)) is not None]
    if borne:
        whole = [t for t in tried if not any(t is old for old, _ in borne)]
        again = [(less, old.home) for old, less in borne]
        tried = [*whole, *fitted_insertions(found.seen, template, again, options, say, 0.98, 1.0)]
    return scored(finished(tried, options), options.jobs)


def _without_zeros(trial: Candidate, found: Searched) -> Insertion | None:
    effects = (e for e in found.options.catalogue if e.name == trial.effect)
    made = (e.without_zeros(found.seen, trial.insertion, trial.fit.values) for e in effects)
    return next(made, None)


MUCH = 0.5
"""Part of the misfit above the noise that a law explains whose richer forms are worth a fit."""
LOUD = 1.5
"""Times the noise that a law leaves from which forms of others are tried that explain less."""
AS_GOOD = 1.1
"""Part of what the best law leaves that a form may leave for both to be compared."""
NEARLY = 0.9
"""Part of what the best law explains that it explains at least."""


def gained(law: Scored, plain: BlockScore) -> float:
    """Mean square that a law removes."""
    return plain.square - law.score.square


def best_form(forms: Sequence[Scored], simple: Scored, limits: Thresholds) -> Scored | None:
    """Return the form with the fewest numbers among the best, None if the simple law will do.

    One whose own strengths may be zero is no form of that effect (a damper that is as steep either
    way is no uneven one), unless a memory gives all numbers one scale that nobody tells.
    """
    if simple.left.most <= limits.noise:
        return None
    rest = simple.score.square - 1.0
    better = [
        f for f in forms
        if f.trial.itself and simple.score.behind(f.score) > limits.z
        and f.trial.test < simple.trial.test
        and (f.left.most <= limits.noise or simple.score.square - f.score.square > MOSTLY * rest)
        and (f.trial.insertion.kind == "memory" or not _vanishes(f.trial))
    ]  # fmt: skip
    if not better:
        return None
    best = min(better, key=lambda f: f.score.loss)
    alike = [f for f in better if f is best or f.score.behind(best.score) < limits.z]
    return min(alike, key=lambda f: len(f.trial.fit.problem.free))


def _vanishes(form: Candidate) -> bool:
    return may_vanish(form.fit, form.insertion.strengths)
