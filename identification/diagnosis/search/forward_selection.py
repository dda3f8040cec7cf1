"""One effect after the other: search, decide, repair; then whether all is explained."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.evidence.answer import RIGHT, Decision
from identification.diagnosis.evidence.block_score import BlockScore, score
from identification.diagnosis.evidence.decision import BARE
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.remaining import remaining
from identification.diagnosis.evidence.shares import ANYTHING
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.score_test import Screened
from identification.diagnosis.search.base import Base, base_of
from identification.diagnosis.search.candidates import (
    Candidate,
    DiagnosisOptions,
    finish,
    fitted,
    trial_of,
)
from identification.diagnosis.search.looks import Looks
from identification.diagnosis.search.nominal import (
    deeper,
    held_otherwise,
    held_to_residual,
    misread,
    weighed_by,
)
from identification.diagnosis.search.one_step import decided, searched
from identification.diagnosis.search.task import Progress, Searched, SearchTask
from identification.diagnosis.search.within_reason import within_reason
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit
from identification.estimation.sub_steps import fit_from
from identification.study.read_after import READ_AFTER


@dataclass(frozen=True, eq=False)
class SelectionStage:
    """Decisions in order, with the base, scene, screening and relations they started from.

    Without a decision it was stopped in its first step; there may be no scene then.
    """

    decisions: tuple[Decision, ...]
    base: Base
    scene: FittedModel | None
    ranking: tuple[Screened, ...]
    relations: tuple[BlindRelation, ...] = ()
    stopped: bool = False


class Halted(KeyboardInterrupt):
    """The search was stopped (Ctrl-C, or its time was over) with `decisions` made before."""

    def __init__(self, decisions: Sequence[Decision]) -> None:
        super().__init__()
        self.decisions = list(decisions)


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
    A search that is stopped gives the steps that were finished, and what was screened by then.
    """
    done = Looks((*options.catalogue, UNNAMED), base.fit.problem.with_chain, options.jobs)
    task = SearchTask(done, options, limits, classes, say, tuple(given))
    stopped, decisions = False, []
    try:
        decisions = _resumed(base, known, task)
        if not decisions:
            base, first = _first(base, task)
            decisions = _forward(base, task, max(1, options.effects), found=first)
        begun, again = decisions[0], _revisited(base, decisions, task)
        if again is not None and again[-1].remaining is not None:
            decisions = again
        decisions = _all_needed(begun, decisions, base.fit, task)
    except KeyboardInterrupt as stop:
        decisions = decisions or (stop.decisions if isinstance(stop, Halted) else [])
        decisions, stopped = not_again(decisions), True
        if not decisions:
            known_scene, ranked = done.looked(base.fit)
            return SelectionStage((), base, known_scene, tuple(ranked), done.blind, stopped)
    seen, ranked = done.of(base.fit)
    told = _together(base.fit, decisions, limits)
    # what is taken back leaves more, and no name beside that is exact
    told = _held_to_noise(within_reason(told, base.fit.problem.graph.parameters), limits)
    return SelectionStage(told, base, seen, tuple(ranked), done.blind, stopped)


def _first(base: Base, task: SearchTask) -> tuple[Base, Searched]:
    """Search once, and again where it shows a better fit of the model as it is, or less noise.

    Nothing may be called missing that better values of the same model explain. A noise that was
    read off something else, such as a command with steps, hides how laws differ; readings taken at
    the other side of a step hide all places but the one that makes up for it.
    """
    found = searched(base, task, 0)
    for begun in (_read_otherwise, _deeper, _weighed):
        best = min(found.trials, key=lambda t: t.train, default=None)
        other = None if best is None else begun(base.fit, best.fit, task)
        if other is not None:
            base = base_of(other)
            found = searched(base, task, 0)
    return base, found


def _read_otherwise(base: Fit, best: Fit, task: SearchTask) -> Fit | None:
    """Return the model as it is, read at the side of a step where the best law has readings."""
    hold = best.problem.data.hold
    if READ_AFTER not in {hold, base.problem.data.hold} or hold == base.problem.data.hold:
        return None
    other = held_otherwise(base, hold, base.problem.n_sub)
    return None if other.status is FitStatus.BROKEN else other


def _deeper(base: Fit, best: Fit, task: SearchTask) -> Fit | None:
    return deeper(base, best.values)


def _weighed(base: Fit, best: Fit, task: SearchTask) -> Fit | None:
    floor = misread(best, task.given)
    other = None if floor is None else weighed_by(base, floor)
    if other is None or other.status is FitStatus.BROKEN:
        return None
    return deeper(other, best.values) or other  # beside less noise another minimum may show


def _held_to_noise(decisions: tuple[Decision, ...], limits: Thresholds) -> tuple[Decision, ...]:
    """Call no name exact beside a rest above the noise, or beside some that something improves."""
    named = [d for d in decisions if d.kind == "missing_physics" and d.chosen is not None]
    if not named or named[-1].chosen is None:
        return decisions
    left = [remaining(named[-1].chosen.fit)]
    if decisions[-1] is not named[-1]:  # what the last look found, by the noise of the repair
        left += [r for r in (decisions[-1].remaining,) if r is not None]
    least = BARE if decisions[-1].kind == "unknown_physics" else limits.noise
    if all(r.most <= least for r in left):
        return decisions
    return tuple(
        replace(d, answer="approximate", confidence=RIGHT["approximate"])
        if d in named and d.answer == "exact"
        else d
        for d in decisions
    )


def _forward(
    base: Base,
    task: SearchTask,
    count: int,
    begin: int = 0,
    named: tuple[str, ...] = (),
    found: Searched | None = None,
) -> list[Decision]:
    """Decide, repair, and look again, at most `count` times; `found` was searched already."""
    decisions: list[Decision] = []
    places = named
    for number in range(begin, begin + count):
        here = found if found is not None and number == begin else None
        try:
            decision = decided(here or searched(base, task, number, places), task)
            other = _in_its_valley(base, decisions, decision)
            if other is not None:
                decisions[-1], base = replace(decisions[-1], chosen=other), base_of(other.fit)
                decision = decided(searched(base, task, number, places), task)
        except KeyboardInterrupt:
            raise Halted(decisions) from None
        decisions.append(decision)
        more = decision.kind == "missing_physics" or _promising(decision, number, task.options)
        if decision.chosen is None or not more or number + 1 == begin + count:
            break
        # what the repair leaves bounds the noise: one read too high hides what comes next
        base = base_of(held_to_residual(decision.chosen.fit, task.given))
        if decision.kind == "missing_physics":
            places = (*places, decision.chosen.element)
    return decisions


def _in_its_valley(base: Base, before: Sequence[Decision], decision: Decision) -> Candidate | None:
    """Return a better fit of the last repair if a further law owes what it explains to that.

    As at first: nothing more is missing where better values of what is there explain it.
    """
    last = before[-1].chosen if before else None
    if last is None or decision.kind != "missing_physics" or decision.chosen is None:
        return None
    other = deeper(base.fit, decision.chosen.fit.values)
    return None if other is None else trial_of(last.insertion, last.home, other)


def _resumed(base: Base, known: Sequence[Decision], task: SearchTask) -> list[Decision]:
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


NOT_AGAIN = "it was not tried again beside what was named after it: the search was stopped"


def not_again(decisions: Sequence[Decision]) -> list[Decision]:
    """Give a first choice that is not sure no probability where it was not taken up again.

    It may have stood for what was named after it; `_revisited` would have told.
    """
    if not decisions:
        return []
    first, *more = decisions
    later = any(d.kind == "missing_physics" for d in more)
    if first.kind == "missing_physics" and first.answer != "exact" and later:
        first = replace(first, confidence=0.0, reasons=(*first.reasons, NOT_AGAIN))
    return [first, *more]


def _revisited(base: Base, decisions: list[Decision], task: SearchTask) -> list[Decision] | None:
    """Take a first choice that is not sure back, and decide it beside what came after it.

    Of a choice that was named, but not exactly, only whether what came after it explains all alone.
    """
    first, *more = decisions
    named = [d for d in more if d.kind == "missing_physics" and d.chosen is not None]
    if first.answer == "exact" or not named:
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
    if first.kind == "missing_physics" and after[0].kind != "explained":
        return None
    # beside the second one the first is named, or is in question at the same place again
    if after[0].kind == "unknown_physics" and not _agree(first, after[0], task.limits):
        return None
    return [replace(named[0], chosen=alone), *after]


def _agree(first: Decision, after: Decision, limits: Thresholds) -> bool:
    """Whether look-alikes stay in question at the place of the first choice, and leave noise."""
    if after.answer != "look_alikes" or after.chosen is None:
        return False
    same = bool(set(after.places) & set(first.places))
    return same and remaining(after.chosen.fit).is_noise(limits.noise)


def _together(nominal: Fit, decisions: list[Decision], limits: Thresholds) -> tuple[Decision, ...]:
    """Name the first effect after all if others explain what it left.

    All of them together have to do what one law alone has to: as much as any form that is freer.
    """
    first, *more = decisions
    if first.kind == "missing_physics" or not more:
        return tuple(decisions)
    named = [d for d in more if d.kind == "missing_physics" and d.chosen is not None]
    if not named or len(named) < len([d for d in more if d.kind != "explained"]):
        return (first,)
    last = named[-1].chosen
    assert last is not None
    assert first.chosen is not None
    left, own = remaining(last.fit), first.chosen.fit
    plain, joint = (score(_weighed_as(f, own)) for f in (nominal, last.fit))
    freer = any(_part(joint, plain, k.score) < limits.law for k in first.kinds)
    if first.rivals or freer or not left.is_noise(limits.noise):
        return (first,)
    sure = replace(
        first, kind="missing_physics", answer="approximate",
        physics=first.chosen.insertion.kind, confidence=RIGHT["approximate"],
        reasons=(*first.reasons, f"together with {last.label} it leaves nothing but noise"),
    )  # fmt: skip
    return (sure, *more)


def _all_needed(
    first: Decision, decisions: list[Decision], nominal: Fit, task: SearchTask
) -> list[Decision]:
    """Take the further names back where one of the laws needs none of them.

    What followed a choice that was not sure was not asked whether it is the rest of that law, as
    what follows a name is: it is where the law's own kind at its own place, whatever the form, does
    as well as everything that was named. An influence from outside imitates such a rest best.
    """
    told = _together(nominal, decisions, task.limits)
    named = [d.chosen for d in told if d.kind == "missing_physics" and d.chosen is not None]
    if first.kind == "missing_physics" or len(named) < 2:
        return decisions
    alone = {(t.effect, t.element): t for t in first.trials}
    for law in named:
        own = alone.get((law.effect, law.element))
        if own is None or own.insertion.kind in ANYTHING:
            continue
        whole = _weighed_as(named[-1].fit, own.fit)
        forms = task.done.kinds(own.fit, whole, (own.element,))
        kind, best = own.insertion.kind, score(whole)
        if any(k.kind == kind and k.score.behind(best) < task.limits.z for k in forms):
            others = ", ".join(t.label for t in named if t is not law)
            reason = f"{others} beside {own.label} explains no more than another form of that law"
            return [replace(first, reasons=(*first.reasons, reason))]
    return decisions


def _part(one: BlockScore, plain: BlockScore, other: BlockScore) -> float:
    """Part that one hypothesis explains of what another does, or one that does as much."""
    if one.loss <= other.loss:
        return 1.0
    return 1.0 - one.excess(other) / max(plain.excess(other), 1e-12)


def _weighed_as(result: Fit, other: Fit) -> Fit:
    """Return a fit with the noise of another one: scores compare in one unit only."""
    data = replace(result.problem.data, floor=other.problem.data.floor)
    return replace(result, problem=replace(result.problem, data=data))
