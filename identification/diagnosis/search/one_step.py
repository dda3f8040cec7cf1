"""One step of the search: look at what a fit leaves, fit what may be missing, decide."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from itertools import zip_longest

import numpy as np

from bondgraph.graph.sensors import Sensor
from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.block_score import BlockScore, score
from identification.diagnosis.evidence.decision import decide
from identification.diagnosis.evidence.hypotheses import Evidence, Thresholds
from identification.diagnosis.evidence.kind_pairs import MANY, in_every_pair
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.kinds_told import alike_kinds
from identification.diagnosis.evidence.nearest import nearest
from identification.diagnosis.evidence.remaining import remaining
from identification.diagnosis.evidence.shares import explained
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.screening.carried import FAR, astray, bent, carried_away
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.score_test import Screened
from identification.diagnosis.search.afresh import begun_afresh
from identification.diagnosis.search.base import Base, base_of
from identification.diagnosis.search.candidates import (
    EXPLAINED,
    Candidate,
    DiagnosisOptions,
    each_once,
    finished,
    fitted,
    not_worse,
    rivals_of,
    search,
    to_their_ends,
)
from identification.diagnosis.search.near_declared import near_declared
from identification.diagnosis.search.own_steps import without_own_steps
from identification.diagnosis.search.passed_over import by_merit, elsewhere, overlooked
from identification.diagnosis.search.richer_laws import with_forms
from identification.diagnosis.search.scored_laws import scored
from identification.diagnosis.search.task import Searched, SearchTask, told_within
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import fit
from identification.report.numbers import times_noise

Progress = Callable[[str, float], None]


def searched(base: Base, task: SearchTask, number: int, named: tuple[str, ...] = ()) -> Searched:
    """Screen every effect at every port of a fit, and fit the most promising ones."""
    done, options, limits = task.done, task.options, task.limits
    low = 0.12 + 0.8 * number / max(1, options.effects)
    task.say("screening every effect at every port", low)
    plain, before = score(base.fit), remaining(base.fit)
    if number == 0 and not before.is_noise(limits.noise):
        done.ask_where(base.fit, task.classes)
    seen, ranked = done.of(base.fit)
    kinds = done.kinds(base.fit, base.fit)
    if number == 0 and astray(base.fit):
        # its course says little of what would be at its ports; that of the declared values may
        declared = fit(replace(base.fit.problem, starts={}), max_iterations=0)
        if declared.status is not FitStatus.BROKEN:
            kinds = _merged(kinds, done.kinds(base.fit, declared))
            ranked = in_turn(ranked, done.of(declared)[1])
            options = replace(options, keep=2 * options.keep)
    evidence = Evidence(
        plain, (), tuple(kinds), before, base.fit.chi2("test"), base.fit.chi2("train"),
        task.classes, named=named, several=bool(base.fit.problem.data.starts),
    )  # fmt: skip
    # without a pattern there is nothing to explain, and noise is not searched
    if not (kinds and _hopeful(plain, kinds[0], limits)) and before.is_noise(limits.noise):
        quiet = replace(evidence, kinds=())
        return Searched(base, number, seen, ranked, options, quiet, quiet=True)
    asked = number == 0 and not carried_away(base.fit)
    where = done.where(base.fit, task.classes) if asked else ()
    tell, near = told_within(task, number), None
    if number == 0 and not astray(base.fit) and (near := near_declared(base.fit)):
        kinds = _merged(kinds, done.kinds(base.fit, near))
    there = [k for k in kinds if k.element in where] if where else kinds
    evidence = replace(evidence, kinds=tuple(there), located=where)
    scenes = [(seen, base, _at(ranked, where))]
    if near is not None:
        looks = done.of(near)
        scenes.insert(0, (looks[0], Base(base.fit, base_of(near).template), _at(looks[1], where)))
    found, (seen, base, ranked) = _in_scenes(scenes, options, tell)
    trials = _finished(found, options, limits.noise)
    if any(_refutes(t, where) for t in trials):
        evidence = replace(evidence, kinds=tuple(kinds), located=())
        ranked = done.of(seen.nominal)[1]
    lost = trials and min(t.train for t in trials) > FAR
    if number == 0 and lost and bent(base.fit):
        trials = begun_afresh(trials, options)
    return Searched(base, number, seen, ranked, options, evidence, tuple(trials))


Scene = tuple[FittedModel, Base, list[Screened]]
"""A course of the model, what candidates are built from along it, and how they rank there."""


def _at(ranked: list[Screened], where: Collection[str]) -> list[Screened]:
    """Return what may be in question where only some places are."""
    if not where:
        return ranked
    return [s for s in ranked if s.element.name in where or s.effect.joins or s.effect.plain]


def _refutes(trial: Candidate, where: Collection[str]) -> bool:
    """Whether an element that the model lacks elsewhere leaves noise: no place is excluded then.

    What a relation leaves is found by a descent, and without the element that may end anywhere.
    """
    elsewhere = bool(where) and trial.element not in where
    return elsewhere and trial.insertion.plain and trial.train < EXPLAINED


def _in_scenes(
    scenes: Sequence[Scene], options: DiagnosisOptions, tell: Progress
) -> tuple[list[Candidate], Scene]:
    """Search along one course after the other until a law explains most; the best scene is kept."""
    found: list[Candidate] = []
    best, kept, plain = np.inf, scenes[0], scenes[0][1].fit.chi2("train")
    for scene in scenes:
        made = search(scene[0], scene[1].template, scene[2], options, tell)
        least = min((t.train for t in made), default=np.inf)
        if least < best:
            best, kept = least, scene
        found = each_once([*found, *made])
        if best < MOST * plain:
            break
    return sorted(found, key=lambda t: t.test), kept


MOST = 0.05
"""Part of a misfit that a law leaves whose course is followed alone."""


def decided(found: Searched, task: SearchTask) -> Decision:
    """Decide what was found; laws that the evidence asks for are fitted first."""
    if found.quiet:
        return decide(found.evidence, task.limits)
    ranked, limits, done = found.ranked, task.limits, task.done
    where = found.evidence.located
    trials = not_worse(found.trials, found.options)
    laws = scored(trials, found.options.jobs)
    best = laws[0].trial if laws and laws[0].score.loss < found.evidence.plain.loss else None
    evidence = replace(found.evidence, laws=laws)
    if best is not None:
        evidence = along_best(found, task, evidence)
    decision = decide(evidence, limits)
    alike = alike_kinds(evidence, limits)
    first = overlooked(decision, alike, trials, ranked, task.classes)[: found.options.more]
    noise = evidence.before.is_noise(limits.noise)
    further = found.number == 0 and unexplained(decision, evidence) and not noise
    if further:
        first += by_merit(trials, ranked, first, limits)[: found.options.more]
    if first and (best is not None or further):
        evidence = _with_laws(found, task, evidence, first)
        now = evidence.laws[0].trial if evidence.laws else best
        if further and now is not None and now is not best:
            # what was found late is held against its rivals and the forms along its own course
            tried = {(s.trial.effect, s.element) for s in evidence.laws}
            rivals = rivals_of(now, ranked, tried, found.options.more)
            evidence = _with_laws(found, task, evidence, rivals)
            evidence = along_best(found, task, evidence)
        decision = decide(evidence, limits)
    if same := elsewhere(decision, alike_kinds(evidence, limits), evidence, ranked):
        evidence = _with_laws(found, task, evidence, same[: found.options.more])
        decision = decide(evidence, limits)
    richer = with_forms(found, task, evidence, decision)
    if richer is not evidence:
        evidence = along_best(found, task, richer)
        decision = decide(evidence, limits)
    if where and decision.kind == "unknown_physics":
        decision = _decided_there(found, task, evidence, decision)
    chosen = decision.chosen if decision.kind == "missing_physics" else None
    if where:
        if chosen is None or not chosen.insertion.joined:
            decision = replace(decision, reasons=(*decision.reasons, why_there(done.blind, where)))
    elif found.number == 0 and in_doubt(decision, limits):
        decision = _decided_in_pairs(found, task, evidence, decision)
    if found.number == 0 and not where and astray(found.base.fit):
        decision = without_place(decision, evidence)
    problem = found.base.fit.problem
    units = {s.name: s.unit for s in problem.graph.of_type(Sensor)}
    return without_own_steps(decision, evidence.before, problem.data, limits.noise, units)


def without_place(decision: Decision, evidence: Evidence) -> Decision:
    """Return a decision that tells no place unless it tells what sits there, but what is nearest.

    Of a fit that follows nothing, forms of a reading follow the recording wherever the fault is.
    """
    untold = decision.kind == "unknown_physics" and decision.answer == "unknown"
    if not untold or not decision.places:
        return decision
    return replace(decision, places=(), nearest=nearest(evidence))


def in_doubt(decision: Decision, limits: Thresholds) -> bool:
    """Whether a few kinds are in question, none is told, and each leaves more than noise."""
    open_ones = decision.kind == "unknown_physics" and decision.answer == "unknown"
    few = 2 <= len(decision.kinds) <= MANY
    return open_ones and few and all(k.score.noise.max() > limits.noise for k in decision.kinds)


def _decided_in_pairs(
    found: Searched, task: SearchTask, evidence: Evidence, decision: Decision
) -> Decision:
    """Decide with what every good pair of kinds holds: another effect may lie in the way."""
    along = evidence.laws[0].trial.fit if evidence.laws else found.base.fit
    task.say("looking two effects deep", 0.93)
    pairs = task.done.pairs(found.base.fit, along, decision.kinds)
    single = min((k.score for k in evidence.kinds), key=lambda s: s.loss)
    held = in_every_pair(pairs, decision.kinds, single, task.limits, task.classes)
    return decide(replace(evidence, paired=held), task.limits) if held else decision


def _decided_there(
    found: Searched, task: SearchTask, evidence: Evidence, decision: Decision
) -> Decision:
    """Decide with what is seen along the true histories of the only places in question."""
    there = task.done.there(found.base, evidence.located)
    if there is None:
        return decision
    for scene_there, wanted in there.likeliest(found.options.more):
        at = replace(found, seen=scene_there, base=there.base)
        evidence = _with_laws(at, task, evidence, wanted)
    if as_good(there.kinds, evidence):
        evidence = replace(_with_kinds(evidence, there.kinds), along=True)
    return decide(evidence, task.limits)


def along_best(found: Searched, task: SearchTask, evidence: Evidence) -> Evidence:
    """Return the evidence with kinds along the course of the best law.

    A curve or a filter of a reading that follows the recording predicts it, whatever made it do so:
    at a sensor counts the course of the best law there.
    """
    base, where = found.base.fit, evidence.located or None
    best = evidence.laws[0]
    sensors = {s.name for s in base.problem.graph.of_type(Sensor)}
    more = [
        k for k in task.done.kinds(base, best.trial.fit, where)
        if k.element not in sensors or k.element == best.element
    ]  # fmt: skip
    for name in sensors.intersection(where or sensors) - {best.element}:
        own = next((s for s in evidence.laws if s.element == name), None)
        if own is not None and explained(own, evidence.plain, best.score) > LITTLE:
            more += task.done.kinds(base, own.trial.fit, (name,))
    return _with_kinds(evidence, more)


def _with_kinds(evidence: Evidence, more: Sequence[KindScore]) -> Evidence:
    return replace(evidence, kinds=tuple(_merged(evidence.kinds, more)))


def _with_laws(
    found: Searched, task: SearchTask, evidence: Evidence, wanted: Sequence[Screened]
) -> Evidence:
    """Return the evidence with more laws fitted, and those that could not be."""
    options, tell = found.options, told_within(task, found.number)
    beat = min((s.trial.train for s in evidence.laws), default=evidence.trained)
    more = fitted(found.seen, found.base.template, wanted, options, tell, 0.9, 1.0, beat)
    every = each_once([*(s.trial for s in evidence.laws), *finished(more, options)])
    made = {(t.effect, t.element) for t in every}
    names = [(s.effect.name, s.element.name) for s in wanted]
    untried = (*evidence.untried, *(at for at in names if at not in made))
    laws = scored(not_worse(every, options), options.jobs)
    return replace(evidence, laws=laws, untried=untried)


def unexplained(decision: Decision, evidence: Evidence) -> bool:
    """Whether no law is named, and all that were fitted leave most of the misfit."""
    least = min((s.trial.train for s in evidence.laws), default=evidence.trained)
    return decision.kind == "unknown_physics" and least > LITTLE * evidence.trained


LITTLE = 0.5
"""Part of the misfit, as a mean square, that the best law leaves if it explains little."""


def as_good(kinds: Sequence[KindScore], evidence: Evidence) -> bool:
    """Whether forms along the true histories explain as much as those known before, or more."""
    if not kinds:
        return False
    found = min((k.score for k in kinds), key=lambda x: x.loss)
    best = min((k.score for k in (*kinds, *evidence.kinds)), key=lambda x: x.loss)
    return found.excess(best) <= (1.0 - ENOUGH) * max(evidence.plain.excess(best), 1e-12)


ENOUGH = 0.97
"""Part of what the best form explains, from which those along the true histories are as good."""


def why_there(relations: Sequence[BlindRelation], where: Collection[str]) -> str:
    """Say in a sentence why a mismatch sits at some places, whatever its law."""
    decided = [r for r in relations if r.decided]
    here = min(r.train for r in decided if r.ports[0] in where)
    beside = [r.train for r in decided if r.ports[0] not in where]
    said = (
        f"whatever its law, it sits at {'one of ' * (len(where) > 1)}{', '.join(where)}: that "
        f"leaves {times_noise(here):.3g} times the noise in training, all readings together"
    )
    if not beside:
        return said
    return f"{said}; any other element that the model has {times_noise(min(beside)):.3g} at least"


def in_turn(first: Sequence[Screened], second: Sequence[Screened]) -> list[Screened]:
    """Return the best of both rankings alternately, each effect and place once."""
    found: dict[tuple[str, str], Screened] = {}
    for pair in zip_longest(first, second):
        for s in pair:
            if s is not None:
                found.setdefault((s.effect.name, s.element.name), s)
    return list(found.values())


def _hopeful(plain: BlockScore, kind: KindScore, limits: Thresholds) -> bool:
    """Whether a search is worth its time: half of what a name will need."""
    gain = plain.excess(kind.score)
    return plain.behind(kind.score) > 0.7 * limits.z and gain > 0.3 * limits.gain


def _merged(first: Sequence[KindScore], second: Sequence[KindScore]) -> list[KindScore]:
    """Keep the better score of every kind and place, best first."""
    best: dict[tuple[str, str], KindScore] = {}
    for k in (*first, *second):
        at = (k.element, k.kind)
        if at not in best or k.score.loss < best[at].score.loss:
            best[at] = k
    return sorted(best.values(), key=lambda k: k.score.loss)


def _finished(
    trials: Sequence[Candidate], options: DiagnosisOptions, noise: float
) -> list[Candidate]:
    """Fit the best few to the end: those that the decision will compare.

    Where even they leave more than noise, those that were on their way are followed as well: a
    large effect bends the model so far that the right law starts behind a wrong one. So are those
    that the best one is confused with at its place: none is out of question before its end.
    """
    if not trials:
        return []
    best = min(t.train for t in trials)
    near = [t for t in trials if t.train < 1.5 * best][:4]
    doubted = [t for t in trials if t.misstated and t not in near]  # what is stated is asked first
    done = finished([*near, *doubted], options)
    best = min(t.train for t in done)
    if best > noise**2:
        known = {t.label for t in done}
        still = [t for t in trials if t.label not in known and _on_its_way(t, best)]
        done += finished(sorted(still, key=lambda t: t.train)[:STILL], options)
    named, known = [t for t in done if t.effect != UNNAMED.name], {t.label for t in done}
    first = min(named, key=lambda t: t.train, default=done[0])
    alike = [
        t for t in trials
        if t.label not in known and _on_its_way(t, first.train) and _like(t, first)
    ]  # fmt: skip
    done = to_their_ends([*done, *finished(alike, options)], options)
    rest = [t for t in trials if t.label not in {d.label for d in done}]
    return sorted([*done, *rest], key=lambda t: t.test)


def _like(trial: Candidate, best: Candidate) -> bool:
    """Whether a law is known to look like the best one at its place, and is not just richer."""
    one, other = trial.insertion, best.insertion
    known = trial.effect in (*other.confused_with, *other.simpler)
    alike = known or best.effect in one.confused_with
    return trial.element == best.element and alike and best.effect not in one.simpler


def _on_its_way(trial: Candidate, best: float) -> bool:
    unfinished = trial.fit.status is FitStatus.ITERATIONS and trial.effect != UNNAMED.name
    return unfinished and trial.train < BEHIND * best


STILL = 6
"""Unfinished fits that are followed at most."""
BEHIND = 10.0
"""Times the misfit of the best fit up to which an unfinished one is followed."""
