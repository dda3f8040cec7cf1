"""One effect after the other: screen, fit, decide, repair; then whether all is explained."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np
from joblib import Parallel, delayed, effective_n_jobs

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import UNNAMED, Effect
from identification.diagnosis.catalogue.effect import kind_at
from identification.diagnosis.evidence.answer import RIGHT, Decision
from identification.diagnosis.evidence.block_score import BlockScore, score
from identification.diagnosis.evidence.decision import decide
from identification.diagnosis.evidence.hypotheses import Evidence, Scored, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore, bench_of, kind_scores
from identification.diagnosis.evidence.kinds_told import CURVES, alike_kinds
from identification.diagnosis.evidence.remaining import remaining
from identification.diagnosis.localisation.blind_relations import BlindRelation, blind_relations
from identification.diagnosis.localisation.places_without_name import located
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import Screened, screen
from identification.diagnosis.search.base import Base, base_of
from identification.diagnosis.search.candidates import (
    Candidate,
    DiagnosisOptions,
    astray,
    finish,
    finished,
    fitted,
    not_worse,
    rivals_of,
    search,
    trial_of,
)
from identification.diagnosis.search.nominal import held_to_residual
from identification.diagnosis.search.there import There, look_there
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit
from identification.estimation.sub_steps import fit_from
from identification.study.problem import Problem

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class SelectionStage:
    """Decisions in order, with the scene, screening and relations they started from."""

    decisions: tuple[Decision, ...]
    scene: FittedModel
    ranking: tuple[Screened, ...]
    relations: tuple[BlindRelation, ...] = ()


class _Looks:
    """Scenes, screenings and kinds made so far: what is left beside a repair starts the next step.

    Parameters
    ----------
    plain : BondGraph
        The declared model: additions at ports are sent through it.
    jobs : int
        Threads.
    """

    def __init__(self, catalogue: tuple[Effect, ...], plain: BondGraph, jobs: int = 1) -> None:
        self.catalogue, self.plain, self.jobs = catalogue, plain, jobs
        self.known: dict[int, tuple[Fit, FittedModel, list[Screened]]] = {}
        self.blind: tuple[BlindRelation, ...] = ()
        self.coming: Iterator[tuple[BlindRelation, ...]] | None = None

    def of(self, fit: Fit) -> tuple[FittedModel, list[Screened]]:
        """Scene and ranking of one fit."""
        if id(fit) not in self.known:
            seen = scene(fit)
            looks = screen(seen, probes(fit, self.plain), self.catalogue, self.jobs)
            self.known[id(fit)] = (fit, seen, looks)
        return self.known[id(fit)][1:]

    def ask_where(self, base: Fit, classes: Isolability) -> None:
        """Let a process of its own look for the relations that `where` will need."""
        if effective_n_jobs(self.jobs) > 1:
            work = [delayed(_relations)(base, classes)]
            self.coming = Parallel(n_jobs=self.jobs, return_as="generator")(work)

    def where(self, base: Fit, classes: Isolability) -> tuple[str, ...]:
        """Return the only places where the mismatch may sit, whatever its law."""
        coming, self.coming = self.coming, None
        self.blind = _relations(base, classes) if coming is None else next(coming)
        return located(self.blind, base.problem.data.names)

    def there(self, base: Base, where: Collection[str]) -> There | None:
        """Look at the only places where the mismatch may sit."""
        return look_there(base, self.blind, where, self.catalogue, self.plain, self.jobs)

    def kinds(
        self, base: Fit, better: Fit, places: Collection[str] | None = None
    ) -> list[KindScore]:
        """Score every kind at every port, on top of `base`, along the histories of `better`."""
        try:
            bench = bench_of(base, better, self.plain)
            return kind_scores(bench, *self.of(better), places, jobs=self.jobs)
        except BondsightError:
            return []


def _relations(base: Fit, classes: Isolability) -> tuple[BlindRelation, ...]:
    """Relations blind to every place; models that are not linear up to laws have none."""
    try:
        return blind_relations(base, classes)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return ()


@dataclass(frozen=True, eq=False)
class _Search:
    """What every step of one search shares."""

    done: _Looks
    options: DiagnosisOptions
    limits: Thresholds
    classes: Isolability
    say: Progress
    given: tuple[str, ...] = ()


def steps(
    base: Base,
    options: DiagnosisOptions,
    limits: Thresholds,
    classes: Isolability,
    say: Progress,
    given: Collection[str] = (),
    known: Sequence[Decision] = (),
) -> SelectionStage:
    """Look for one effect after another until nothing more shows.

    `given` are readings whose noise the user has stated; the others' may turn out to be lower.
    `known` effects were named on another division of the record: the search goes on beside them.
    """
    done = _Looks((*options.catalogue, UNNAMED), base.fit.problem.with_chain, options.jobs)
    task = _Search(done, options, limits, classes, say, tuple(given))
    decisions = _resumed(base, known, task) or _forward(base, task, max(1, options.effects))
    again = _revisited(base, decisions, task)
    if again is not None and again[-1].remaining is not None:
        decisions = again
    seen, ranked = done.of(base.fit)
    told = _held_to_noise(_together(decisions, limits), limits)
    return SelectionStage(told, seen, tuple(ranked), done.blind)


def _held_to_noise(decisions: tuple[Decision, ...], limits: Thresholds) -> tuple[Decision, ...]:
    """Call no name exact beside a rest above the noise, however that was read."""
    named = [d for d in decisions if d.kind == "missing_physics" and d.chosen is not None]
    if not named or named[-1].chosen is None:
        return decisions
    left = [remaining(named[-1].chosen.fit)]
    if decisions[-1] is not named[-1]:  # what the last look found, by the noise of the repair
        left += [r for r in (decisions[-1].remaining,) if r is not None]
    if all(r.most <= limits.noise for r in left):
        return decisions
    return tuple(
        replace(d, answer="approximate", confidence=RIGHT["approximate"])
        if d in named and d.answer == "exact"
        else d
        for d in decisions
    )


def _forward(
    base: Base, task: _Search, count: int, begin: int = 0, named: tuple[str, ...] = ()
) -> list[Decision]:
    """Decide, repair, and look again, at most `count` times."""
    decisions: list[Decision] = []
    places = named
    for number in range(begin, begin + count):
        decision = _step(base, task, number, places)
        decisions.append(decision)
        more = decision.kind == "missing_physics" or _promising(decision, number, task.options)
        if decision.chosen is None or not more or number + 1 == begin + count:
            break
        # what the repair leaves bounds the noise: one read too high hides what comes next
        base = base_of(held_to_residual(decision.chosen.fit, task.given))
        if decision.kind == "missing_physics":
            places = (*places, decision.chosen.element)
    return decisions


def _resumed(base: Base, known: Sequence[Decision], task: _Search) -> list[Decision]:
    """Fit what was named to the samples of `base`, and look again; empty if it cannot be."""
    chosen = known[-1].chosen if known else None
    if chosen is None:
        return []
    old = chosen.fit
    problem = replace(old.problem, data=replace(base.template.data, hold=old.problem.data.hold))
    again = fit_from(problem, old.point, task.options.final_iterations)
    if again.status is FitStatus.BROKEN:
        return []
    last = replace(known[-1], chosen=trial_of(chosen.insertion, chosen.home, again))
    places = tuple(d.chosen.element for d in known if d.chosen is not None)
    more = task.options.effects - len(known)
    begin = base_of(held_to_residual(again, task.given))
    after = _forward(begin, task, more, len(known), places) if more > 0 else []
    return [*known[:-1], last, *after]


def _promising(decision: Decision, number: int, options: DiagnosisOptions) -> bool:
    """Whether one of two effects may have been found, though it could not be named alone."""
    return number == 0 and options.effects > 1 and decision.share > HALF


HALF = 0.3
"""Part of the excess that the stronger one of two effects explains at least."""


def _revisited(base: Base, decisions: list[Decision], task: _Search) -> list[Decision] | None:
    """Take a first choice that could not be named back, and decide it beside what came after it."""
    first, *more = decisions
    named = [d for d in more if d.kind == "missing_physics" and d.chosen is not None]
    if first.kind == "missing_physics" or not named:
        return None
    second = named[0].chosen
    assert second is not None
    seen, ranked = task.done.of(base.fit)
    same = [
        s for s in ranked if s.effect.name == second.effect and s.element.name == second.element
    ]
    made = fitted(seen, base.template, same, task.options)
    if not made:
        return None
    alone = finish(made[0], task.options.final_iterations, task.options.holds)
    begin = base_of(held_to_residual(alone.fit, task.given))
    after = _forward(begin, task, task.options.effects - 1, 1, (alone.element,))
    # beside the second one the first is named, or is in question at the same place again
    if after[0].kind != "missing_physics" and not _agree(first, after[0], task.limits):
        return None
    return [replace(named[0], chosen=alone), *after]


def _agree(first: Decision, after: Decision, limits: Thresholds) -> bool:
    """Whether look-alikes stay in question at the place of the first choice, and leave noise."""
    if after.answer != "look_alikes" or after.chosen is None:
        return False
    same = bool(set(after.places) & set(first.places))
    return same and remaining(after.chosen.fit).is_noise(limits.noise)


def _together(decisions: list[Decision], limits: Thresholds) -> tuple[Decision, ...]:
    """Name the first effect after all if others explain what it left."""
    first, *more = decisions
    if first.kind == "missing_physics" or not more:
        return tuple(decisions)
    named = [d for d in more if d.kind == "missing_physics" and d.chosen is not None]
    if not named or len(named) < len([d for d in more if d.kind != "explained"]):
        return (first,)
    last = named[-1].chosen
    assert last is not None
    assert first.chosen is not None
    left, joint = remaining(last.fit), score(_weighed_as(last.fit, first.chosen.fit))
    freer = any(joint.behind(k.score) > limits.z for k in first.kinds)
    if first.rivals or freer or not left.is_noise(limits.noise):
        return (first,)
    sure = replace(
        first, kind="missing_physics", answer="approximate",
        physics=first.chosen.insertion.kind, confidence=RIGHT["approximate"],
        reasons=(*first.reasons, f"together with {last.label} it leaves nothing but noise"),
    )  # fmt: skip
    return (sure, *more)


def _weighed_as(result: Fit, other: Fit) -> Fit:
    """Return a fit with the noise of another one: scores compare in one unit only."""
    data = replace(result.problem.data, floor=other.problem.data.floor)
    return replace(result, problem=replace(result.problem, data=data))


def _step(base: Base, task: _Search, number: int, named: tuple[str, ...] = ()) -> Decision:
    done, options, limits = task.done, task.options, task.limits
    low = 0.12 + 0.8 * number / max(1, options.effects)
    task.say("screening every effect at every port", low)
    plain, before = score(base.fit), remaining(base.fit)
    if number == 0 and not before.is_noise(limits.noise):
        done.ask_where(base.fit, task.classes)
    seen, ranked = done.of(base.fit)
    span = 0.8 / max(1, options.effects)

    def tell(text: str, fraction: float) -> None:
        task.say(text, min(low + span * fraction, 0.94))

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
        task.classes, named=named,
    )  # fmt: skip
    # without a pattern there is nothing to explain, and noise is not searched
    if not (kinds and _hopeful(plain, kinds[0], limits)) and before.is_noise(limits.noise):
        return decide(replace(evidence, kinds=()), limits)
    where = done.where(base.fit, task.classes) if number == 0 else ()
    if where:
        ranked = [s for s in ranked if s.element.name in where]
        kinds = [k for k in kinds if k.element in where]
    evidence = replace(evidence, located=where)
    trials = _finished(search(seen, base.template, ranked, options, tell), options)
    trials = not_worse(trials, options)
    laws = scored(trials, options.jobs)
    best = laws[0].trial if laws and laws[0].score.loss < plain.loss else None
    if best is not None:
        kinds = _merged(kinds, done.kinds(base.fit, best.fit, where or None))
    evidence = replace(evidence, laws=laws, kinds=tuple(kinds))
    decision = decide(evidence, limits)

    def with_laws(seen: FittedModel, template: Problem, wanted: Sequence[Screened]) -> Evidence:
        """Return the evidence with more laws fitted, and those that could not be."""
        beat = min((s.trial.train for s in evidence.laws), default=evidence.trained)
        more = fitted(seen, template, wanted, options, tell, 0.9, 1.0, beat)
        every = each_once([*(s.trial for s in evidence.laws), *finished(more, options)])
        made = {(t.effect, t.element) for t in every}
        names = [(s.effect.name, s.element.name) for s in wanted]
        untried = (*evidence.untried, *(at for at in names if at not in made))
        laws = scored(not_worse(every, options), options.jobs)
        return replace(evidence, laws=laws, untried=untried)

    alike = alike_kinds(evidence, limits)
    first = overlooked(decision, alike, trials, ranked, task.classes)[: options.more]
    further = number == 0 and unexplained(decision, evidence) and not before.is_noise(limits.noise)
    if further:
        first += by_merit(trials, ranked, first, limits)[: options.more]
    if first and (best is not None or further):
        evidence = with_laws(seen, base.template, first)
        now = evidence.laws[0].trial if evidence.laws else best
        if further and now is not None and now is not best:
            # what was found late is held against its rivals and the forms along its own course
            tried = {(s.trial.effect, s.element) for s in evidence.laws}
            evidence = with_laws(seen, base.template, rivals_of(now, ranked, tried, options.more))
            best = evidence.laws[0].trial
            kinds = _merged(evidence.kinds, done.kinds(base.fit, best.fit, where or None))
            evidence = replace(evidence, kinds=tuple(kinds))
        decision = decide(evidence, limits)
    if where and decision.kind == "unknown_physics":
        there = done.there(base, where)
        if there is not None:
            for scene_there, wanted in there.likeliest(options.more):
                evidence = with_laws(scene_there, there.base.template, wanted)
            if as_good(there.kinds, evidence):
                kinds = _merged(evidence.kinds, there.kinds)
                evidence = replace(evidence, kinds=tuple(kinds), along=True)
            decision = decide(evidence, limits)
    if where:
        decision = replace(decision, reasons=(*decision.reasons, why_there(done.blind, where)))
    return decision


def unexplained(decision: Decision, evidence: Evidence) -> bool:
    """Whether no law is named, and all that were fitted leave most of the misfit."""
    least = min((s.trial.train for s in evidence.laws), default=evidence.trained)
    return decision.kind == "unknown_physics" and least > LITTLE * evidence.trained


LITTLE = 0.5
"""Part of the misfit, as a mean square, that the best law leaves if it explains little."""


def by_merit(
    trials: Sequence[Candidate],
    ranked: Sequence[Screened],
    besides: Sequence[Screened],
    limits: Thresholds,
) -> list[Screened]:
    """Return laws that were not fitted though the screening is sure of them, the surest first.

    A large effect bends the nominal model, and with it the order of the screening.
    """
    done = {(t.effect, t.element) for t in trials}
    done |= {(s.effect.name, s.element.name) for s in besides}
    left = [
        s for s in ranked
        if (s.effect.name, s.element.name) not in done and s.effect.name != UNNAMED.name
        and s.hint is not None and s.z > limits.z and not s.effect.costly
    ]  # fmt: skip
    return sorted(left, key=lambda s: -s.z)


def each_once(trials: Sequence[Candidate]) -> list[Candidate]:
    """Return the better fit of every law at every place."""
    best: dict[tuple[str, str], Candidate] = {}
    for t in trials:
        at = (t.effect, t.element)
        if at not in best or t.train < best[at].train:
            best[at] = t
    return list(best.values())


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
        f"whatever its law, it sits at {', '.join(where)}: that leaves {here:.3g} times the floor"
    )
    return f"{said}, any other place {min(beside):.3g} at least" if beside else said


def overlooked(
    decision: Decision,
    kinds: Sequence[KindScore],
    trials: Sequence[Candidate],
    ranked: Sequence[Screened],
    classes: Isolability | None = None,
) -> list[Screened]:
    """Return laws that were not fitted though the evidence asks for them.

    Simpler forms of the best law, and, where no law could be named, laws of the kinds and places
    that the decision was left with; then any at places that the readings cannot tell from these.
    """
    done = {(t.effect, t.element) for t in trials}
    left = [s for s in ranked if (s.effect.name, s.element.name) not in done]
    chosen = decision.chosen
    found = [
        s for s in left
        if chosen is not None
        and s.element.name == chosen.element and s.effect.name in chosen.insertion.simpler
    ]  # fmt: skip
    if decision.kind == "unknown_physics" and decision.answer in ("kind", "unknown"):
        for k in kinds:
            found += [
                s for s in left
                if s.element.name == k.element and s.effect.name != UNNAMED.name
                and k.kind in _kinds_of(s)
            ]  # fmt: skip
        same = {n for k in kinds if classes for n in classes.class_of(k.element)}
        found += [
            s for s in left if s.element.name in same and s.effect.name != UNNAMED.name
        ]  # fmt: skip
    return list(dict.fromkeys(found))


def _kinds_of(s: Screened) -> tuple[str, ...]:
    own = kind_at(s.effect.kind, s.element)
    return (own, "surface") if own in CURVES else (own,)


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
        if t.effect in trial.insertion.simpler and t.element == trial.element
    ]  # fmt: skip
    if not simpler:
        return False
    known = simpler[0].fit.problem.graph.parameters
    own = [n for n in trial.insertion.strengths if n not in known]
    return _may_vanish(trial.fit, own) and not _may_vanish(
        simpler[0].fit, simpler[0].insertion.strengths
    )


def _may_vanish(fit: Fit, strengths: Collection[str]) -> bool:
    """Whether zero lies in the interval of every one of some strengths."""
    ends = [e.ci95 for e in fit.estimates if e.name in strengths]
    return bool(ends) and all(low <= 0.0 <= high for low, high in ends)


def _scored(trial: Candidate) -> Scored:
    return Scored(trial, score(trial.fit), remaining(trial.fit))


def _merged(first: Sequence[KindScore], second: Sequence[KindScore]) -> list[KindScore]:
    """Keep the better score of every kind and place, best first."""
    best: dict[tuple[str, str], KindScore] = {}
    for k in (*first, *second):
        at = (k.element, k.kind)
        if at not in best or k.score.loss < best[at].score.loss:
            best[at] = k
    return sorted(best.values(), key=lambda k: k.score.loss)


def _finished(trials: list[Candidate], options: DiagnosisOptions) -> list[Candidate]:
    """Fit the best few to the end: those that the decision will compare."""
    if not trials:
        return trials
    best = min(t.train for t in trials)
    close = [t for t in trials if t.train < 1.5 * best][:4]
    done = finished(close, options)
    rest = [t for t in trials if not any(t is c for c in close)]
    return sorted([*done, *rest], key=lambda t: t.test)
