"""Read the answer off the set of hypotheses that the data cannot tell from the best.

Hypotheses are the model as it is, every law that was fitted, and every kind of physics at every
place (flexible forms). All are scored alike on stretches left out (`block_score`). Who lags behind
the best by more than the noise can explain leaves the set; what stays is the answer, from coarse
to fine: nothing, a kind at a place, one law (exact, or approximate where a flexible form of its
kind does better), look-alikes, or unknown. A set is relative; whether what is left is noise is
asked apart (`remaining`), and only then nothing is said to be missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.evidence.answer import Decision, probability
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.foretold import foretold
from identification.diagnosis.evidence.hypotheses import Evidence, Hypothesis, Scored, Thresholds
from identification.diagnosis.evidence.imitations import (
    ONCE,
    as_coloured,
    shows,
    without_imitations,
)
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.kinds_told import (
    CURVES,
    EXACT,
    LIKE,
    RICHER,
    SHAPELESS,
    best_of,
    follows_what_happened,
    kind_told,
    kinds_alike,
    plainest,
)
from identification.diagnosis.evidence.nearest import nearest
from identification.diagnosis.evidence.places_of_laws import (
    admissible,
    also_there,
    borne_elsewhere,
    outdone_elsewhere,
)
from identification.diagnosis.evidence.shares import ANYTHING, UNUSUAL, explained, law_fit, together
from identification.diagnosis.evidence.unseen import (
    agreed,
    borne_out,
    of_training,
    refuted,
    replicated,
)
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.search.candidates import Candidate
from identification.report.numbers import sureness, times_noise

PART = 0.2
"""Part of the misfit above the noise that an effect must remove to be what is told of it."""


MOST_LEFT = 0.5
"""The same of a further law, of what the named ones leave: less may be the error of those."""


MOSTLY = 0.7
"""The same of a kind: what a form leaves may be of another kind altogether."""


DOUBT = 1.5
"""Standard errors by which a richer law may lead and its simpler one still be named alone."""


FURTHER = 3.0
"""Times the limit by which a law elsewhere has to lead: what a named one leaves may look so."""


MOST = 3
"""More laws than this are no set of look-alikes but nothing known."""


def decide(evidence: Evidence, limits: Thresholds | None = None) -> Decision:
    """Decide what the evidence supports."""
    t, e = limits or Thresholds(), _caused(evidence.here)
    e, reason = without_imitations(e, t)
    decided = _decided(e, t, tuple(s.trial for s in evidence.laws))
    if reason and decided.chosen is not None:
        decided = replace(decided, reasons=(*decided.reasons, reason))
    untold = decided.kind == "unknown_physics" and decided.answer == "unknown"
    return replace(decided, nearest=nearest(e)) if untold and not decided.places else decided


def _decided(e: Evidence, t: Thresholds, trials: tuple[Candidate, ...]) -> Decision:
    quiet = Decision(
        "explained", None, (), (), 0.0, 0.0, (), nominal=e.nominal, trials=trials,
        remaining=e.before,
    )  # fmt: skip
    laws = [s for s in e.laws if s.trial.effect != UNNAMED.name and s.trial.itself]
    best = best_of([*laws, *e.kinds])
    if best is None or not shows(e.plain, best.score, t):
        return _nothing(quiet, e, t, best)
    if e.before.is_noise(t.noise) and as_coloured([*laws, *e.kinds], e, t):
        return _nothing(quiet, e, t, coloured=True)
    if e.named and e.before.measured and e.before.is_noise(t.noise):
        return _within_noise(quiet, e, best)
    if stated := _beyond_its_bounds(laws, best.score, t):
        laws, quiet = [stated], replace(quiet, reasons=(MISSTATED.format(stated.element),))
        e = replace(e, laws=(stated,))
    kinds = kinds_alike(e, best.score, t)
    laws = admissible(laws, kinds, e, t)
    law = _best_law(laws, t)
    if law is not None and shows(e.plain, law.score, t) and _fits(law, kinds, e, t):
        if not _matters(law, e, t):
            return _slight(quiet, e, law, t)
        named = _rest_of(_named(quiet, e, law, laws, t), e, best.score, t)
        clear = not e.named or law.element in e.named or e.plain.behind(law.score) > FURTHER * t.z
        if clear or named.kind != "missing_physics":
            return named
    if not kinds:
        return _nothing(quiet, e, t)
    if not _matters(kinds[0], e, t):
        return _slight(quiet, e, kinds[0], t, kind_told(quiet, e, kinds, law, t).places)
    kinds = kinds_alike(e, best.score, t, told=True)
    sure = foretold(kinds, e, t)
    if sure is not None:
        kinds, e, law, reason = sure
        quiet = replace(quiet, reasons=(reason,))
    elif held := _in_every_pair(kinds, e):
        kinds = held
        quiet = replace(quiet, reasons=(IN_EVERY_PAIR,))
    return _rest_of(kind_told(quiet, e, kinds, law, t), e, best.score, t)


MISSTATED = (
    "a calibration of {0} beyond its stated bounds explains as much as any law, and leaves noise"
)


def _beyond_its_bounds(laws: Sequence[Scored], best: BlockScore, t: Thresholds) -> Scored | None:
    """Return the stated calibration that explains all beyond its bounds; no new law is needed."""
    found = (s for s in laws if s.trial.misstated and s.score.behind(best) < t.z)
    return next((s for s in found if s.left.is_noise(t.noise)), None)


def _caused(e: Evidence) -> Evidence:
    """Leave out a mere course in time where the motion itself explains more of the same change.

    That law may be none that has a name, for it left the range in which it is what its name says:
    still the coefficient follows what happens at its place, not the clock.
    """
    best = {
        s.element: min((o.score.loss for o in e.laws if _moved_by_itself(o, s)), default=np.inf)
        for s in e.laws if s.trial.insertion.kind == "time"
    }  # fmt: skip
    idle = {
        s.element for s in e.laws
        if s.trial.insertion.kind == "time" and best[s.element] < s.score.loss
    }  # fmt: skip
    laws = tuple(s for s in e.laws if s.trial.insertion.kind != "time" or s.element not in idle)
    kinds = tuple(k for k in e.kinds if k.kind != "time" or k.element not in idle)
    return replace(e, laws=laws, kinds=kinds) if idle else e


def _moved_by_itself(law: Scored, course: Scored) -> bool:
    own = law.trial.insertion
    return law.element == course.element and own.kind not in ANYTHING and not law.trial.itself


IN_EVERY_PAIR = "more than one effect is missing; every pair that explains as much as any holds it"


def _in_every_pair(kinds: Sequence[KindScore], e: Evidence) -> list[KindScore]:
    """Return what all good pairs hold; of several such kinds the likeliest, at places alike."""
    held = [k for k in kinds if (k.element, k.kind) in e.paired]
    same = [k for k in held if k.kind == held[0].kind]
    return [k for k in same if together(k.element, held[0].element, e.classes)]


def _within_noise(quiet: Decision, e: Evidence, best: Hypothesis) -> Decision:
    """Something improves surely what a named law leaves, though that is no more than noise.

    A law that is not quite the true one leaves as much, and other laws follow it.
    """
    label = best.label if isinstance(best, KindScore) else best.trial.label
    reason = f"{label} improves it, but {e.before.words}: errors of what was named are as large"
    return replace(quiet, kind="unknown_physics", reasons=(reason,))


def _slight(
    quiet: Decision, e: Evidence, h: Hypothesis, t: Thresholds, places: tuple[str, ...] = ()
) -> Decision:
    """Something improves the model surely, but leaves much of the misfit.

    Where most of it goes with a form at one of `places`, they are told, and no kind. Where it
    shows in one stretch alone and held-out samples are noise, nothing is: two outliers do that.
    """
    said = h.label if isinstance(h, KindScore) else h.trial.label
    if e.before.is_noise(t.noise) and e.plain.paired(h.score) < ONCE:
        return replace(quiet, reasons=(f"{said} shows in one stretch alone; {e.before.words}",))
    part = (e.plain.square - h.score.square) / max(e.plain.square - 1.0, 1e-300)
    if places and part > HALF:
        reason = f"{said} explains {100 * part:.0f} % of the misfit, too little for a kind"
        return replace(quiet, kind="unknown_physics", places=places, reasons=(reason,))
    reason = f"{said} explains little of the misfit: {e.before.words}"
    return replace(quiet, kind="unknown_physics", places=e.located, reasons=(reason,))


HALF = 0.5
"""Part of the misfit above the noise from which a form tells where it sits, if not of what kind."""


def _fits(law: Scored, kinds: Sequence[KindScore], e: Evidence, t: Thresholds) -> bool:
    """Whether a law explains what flexible forms do, at its own place and elsewhere."""
    if e.located and law.left.most > max(MUCH, PART * e.before.most):
        # an input at its place leaves nothing: what is missing there is no law that leaves so much
        return False
    if _spoils(law, e) or borne_elsewhere(law, e, t):
        return False
    if not law.left.is_noise(t.noise) and outdone_elsewhere(law, e, FURTHER * t.z):
        return False
    best = best_of([law, *e.kinds])
    assert best is not None
    own = law.trial.insertion.kind
    if own == "time" and follows_what_happened(law, e, t):
        return False
    if own in SHAPELESS and not law.left.is_noise(t.noise):
        # a law of time alone has to take the right course; a value that changes is told by the
        # motion as well, so that beside a further effect it may lead all laws and forms instead
        mostly = e.plain.square - law.score.square > HALF * (e.plain.square - 1.0)
        return own == "time" and law is best and mostly

    # where no form at its own place, or one that looks the same, explains as much, nothing is
    # discounted
    known = any(together(k.element, law.element, e.classes) for k in kinds)
    odd = not known and law is not best

    def part(k: KindScore) -> float:
        here = k.kind == own and k.element == law.element
        return explained(k, e.plain, best.score, usual=here or odd or e.along)

    # what an approximate law leaves may look like another effect
    alone = not e.named and _alone(law, kinds, e.classes)
    least = EXACT if odd else min(NEAR, t.law) if alone else t.law
    rivals = e.kinds if odd else kinds
    return explained(law, e.plain, best.score) >= least * max(map(part, rivals), default=0.0)


def _spoils(law: Scored, e: Evidence) -> bool:
    """Whether held-out samples of a reading are clearly worse with a law than without it.

    Near the noise they may be: what is taken for noise varies, and another effect may be missing.
    """
    before, after = e.before.over_noise, law.left.over_noise
    told = (n for n in after if n in before and n not in {*e.before.grows, *law.left.grows})
    return any(after[n] > WORSE * max(before[n], MUCH) for n in told)


WORSE = 1.5
"""Times the misfit of a reading without a law that one which is true does not leave with it."""
MUCH = 5.0
"""Times the noise that a law may leave where an input at its place alone explains everything."""


def _alone(law: Scored, kinds: Sequence[KindScore], classes: Isolability | None) -> bool:
    """Whether the set holds a law's own kind at its place, and nothing else but richer forms."""
    own = law.trial.insertion.kind
    allowed = (own, *(RICHER if own in CURVES else ()))
    if own == "memory" and kinds and kinds[0].kind == own:
        allowed = (own, "dissipative")  # friction that remembers counts as that too
    here = [k for k in kinds if together(k.element, law.element, classes)]
    whole = len(here) == len(kinds) and all(k.kind in allowed for k in kinds)
    return whole and any(k.kind == own for k in kinds)


NEAR = 0.9
"""Part that suffices where no other kind of physics and no other place is in the set."""


def _rest_of(decision: Decision, e: Evidence, best: BlockScore, t: Thresholds) -> Decision:
    """Give what is left to an effect that was named before, where its place explains it as well.

    Laws of real things are never quite those of the catalogue: what a named law leaves is no second
    effect as long as a freer law at the same place would do.
    """
    chosen = decision.chosen
    if chosen is not None and decision.kind == "missing_physics" and chosen.element in e.named:
        left = next(s.left for s in e.laws if s.trial is chosen)
        if left.is_noise(t.noise):
            return decision
    for k in e.kinds:
        if k.element in e.named and k.score.behind(best) < t.z:
            reason = f"what is left may be {k.label}: the law named there is not quite the true one"
            if e.before.is_noise(t.noise):
                reason = f"within the noise {k.label} does better: the law there is nearly true"
            return replace(
                decision, kind="unknown_physics", answer="kind", chosen=None, physics=k.kind,
                places=(k.element,), same_place=(), rivals=(), richer=(), confidence=0.0,
                reasons=(*decision.reasons, reason),
            )  # fmt: skip
    return decision


def _here(law: Scored, e: Evidence) -> KindScore | None:
    """Return the best kind at the very place of a law."""
    return next((k for k in e.kinds if k.element == law.element), None)


def _best_law(laws: Sequence[Scored], t: Thresholds) -> Scored | None:
    """Return the best law at a usual place, or one elsewhere that beats it clearly."""
    home = [s for s in laws if s.trial.home]
    away = [s for s in laws if not s.trial.home]
    if not home or not away:
        return min(laws, key=lambda s: s.score.loss, default=None)
    best, other = (min(x, key=lambda s: s.score.loss) for x in (home, away))
    return other if best.score.behind(other.score) > 2 * t.z else best


def _matters(h: Hypothesis, e: Evidence, t: Thresholds) -> bool:
    """Whether a hypothesis removes enough of the misfit to be what is told of it.

    Where the noise was only read off the spectrum, what a fitted law leaves counts as noise if it
    may be; of readings whose noise is known that is the noise.
    """
    noise, least = 1.0, MOSTLY
    if isinstance(h, Scored):
        least = MOST_LEFT if e.named else PART
        if not e.before.measured:
            quiet = [s for s in e.laws if s.left.is_noise(t.noise)]
            better = [_as_noise(s, e) for s in quiet if s.score.square < e.plain.square]
            noise = max(noise, min(better, default=noise))
    return e.plain.square - h.score.square > least * (e.plain.square - noise)


def _as_noise(law: Scored, e: Evidence) -> float:
    """Return the mean square that a law leaves, 1 of every reading whose noise is known."""
    if not e.before.sure:
        return law.score.square
    known = np.array([e.before.known(n) for n in e.before.over_noise])
    return float(np.mean(np.where(known, 1.0, law.score.noise**2)))


def _nothing(
    quiet: Decision,
    e: Evidence,
    t: Thresholds,
    best: Hypothesis | None = None,
    *,
    coloured: bool = False,
) -> Decision:
    """Nothing improves the model: then what is left is noise, or something without a pattern.

    `best` may improve it surely, but by too little to be told: then that is said.
    """
    said = e.before.words
    if not e.before.is_noise(t.noise):
        reason = f"no law and no kind of physics explains it, and {said}: that is no noise"
        return replace(quiet, kind="unknown_physics", places=e.located, reasons=(reason,))
    if e.located:  # what shows elsewhere is theirs
        reason = f"what is missing sits there, but no law and no kind explains it; {said}"
        return replace(quiet, kind="unknown_physics", places=e.located, reasons=(reason,))
    beside = " more than noise with a memory lets it" if coloured else ""
    reason = f"no law and no kind of physics improves it{beside}"
    if best is not None and e.plain.behind(best.score) > t.z:
        label = best.label if isinstance(best, KindScore) else best.trial.label
        gain = 100 * e.plain.excess(best.score)
        reason = f"{label} improves it by {gain:.2g} % of the noise only, too little to be told"
    return replace(quiet, reasons=(f"{reason}; {said}",))


def _named(
    quiet: Decision, e: Evidence, law: Scored, laws: Sequence[Scored], t: Thresholds
) -> Decision:
    """Name one law, or those that the data cannot tell from it."""
    alike = [s for s in laws if s is law or s.score.behind(law.score) < t.z]
    chosen = _without_idle(_simplest(law, alike), laws, e, t)
    nested = richer_names(chosen.trial, [s.trial for s in laws])
    same = tuple(
        s.trial for s in alike if s is not chosen and s.trial.effect == chosen.trial.effect
    ) + also_there(chosen, e, t)
    # what contains the chosen law is never excluded, however well its own fit went
    richer = tuple(
        s.trial for s in laws
        if s.trial.effect in nested and s.element == chosen.element
        and np.isfinite(s.score.loss) and chosen.score.behind(s.score) <= DOUBT
    )  # fmt: skip
    others = [
        s for s in alike
        if s.trial.effect != chosen.trial.effect and s.trial.home and not s.idle
        and (s.trial.effect not in nested or chosen.score.behind(s.score) > DOUBT)
    ]  # fmt: skip
    imitated = [s for s in _imitated(chosen, e) if s not in others]
    disproved = [s for s in others if refuted(s, chosen, e, t)]
    others = [s for s in (*others, *imitated, *_beyond(chosen, e)) if s not in disproved]
    here = _here(chosen, e)
    fit = law_fit(chosen, here, e) if here is not None else float("nan")
    best = best_of([chosen, *e.kinds[:1]])
    assert best is not None
    share = 1.0 - chosen.score.excess(best.score) / max(e.plain.excess(best.score), 1e-12)
    way = "lowers" if chosen.trial.test < e.nominal else "raises"
    reasons = [
        *quiet.reasons,
        f"{chosen.trial.label} {way} what is left of all readings together from "
        f"{times_noise(e.nominal):.4g} to {times_noise(chosen.trial.test):.4g} times the noise on "
        f"held-out samples, {sureness(e.plain.behind(chosen.score))}",
        f"the law explains {100 * fit:.0f} % of what any form could explain there"
        if here is not None
        else "no free form could be tried there",
    ]
    if chosen.trial.insertion.kind == "time":
        reasons.append("that it changes in time is sure, not what changes it")
    if imitated:
        reasons.append("a course in time follows whatever shows in few stretches")
    if disproved:
        reasons.append("held-out samples refute " + ", ".join(s.trial.label for s in disproved))
    if others:
        reasons.append("these do as well: " + ", ".join(s.trial.label for s in others))
    if richer:
        reasons.append("not needed but not excluded: " + ", ".join(r.label for r in richer))
    answer = _answer(chosen, others, fit)
    open_ones = [n for n in chosen.trial.insertion.simpler if (n, chosen.element) in e.untried]
    if open_ones and answer in ("exact", "approximate"):
        answer = "family"
        reasons.append(f"{', '.join(open_ones)} there could not be simulated, so not excluded")
    known = filter(e.before.known, chosen.left.over_noise)
    beside = answer == "exact" and chosen.left.most_of(known) > BARE
    ahead = _ahead(chosen, e, t) if answer == "approximate" or beside else []
    if ahead:
        answer = "unknown"
        reasons.append("better, though nothing to be named: " + ", ".join(a.label for a in ahead))
    members = [chosen, *others]
    physics = {s.trial.insertion.kind for s in members}
    if ahead:
        physics |= {a.insertion.kind for a in ahead}
        answer = "kind" if len(physics) == 1 else answer
    told = [m.element for m in (*(m.trial for m in members), *same, *ahead)]
    if answer == "approximate":
        told += _attached(chosen, e)
    places = tuple(dict.fromkeys(told))
    shown: tuple[KindScore, ...] = (here,) if here is not None else ()
    # one that fails there though it is as good here shows that here decides nothing
    if not all(replicated(s, e) for s in members):
        if len(physics) == 1 and all(borne_out(s, e, t) for s in members):
            answer = "kind"
            reasons.append(
                "held-out samples do not contradict it, but it shows too seldom in training for "
                "its numbers to predict them: record more of it"
            )
        elif of_training(members, e, t):
            reason = f"{chosen.trial.label} follows stretches of training alone; {e.before.words}"
            return replace(quiet, reasons=(reason,))
        else:
            answer, physics = "unknown", set()
            reasons.append("the improvement does not show on the held-out part")
            equal = [*members, *(s for s in alike if s.trial in same)]
            if e.located or not (e.several and agreed(equal, e)):
                places = e.located
            else:
                own = {(s.element, s.trial.insertion.kind) for s in equal}
                shown = tuple(k for k in e.kinds if (k.element, k.kind) in own)
                reasons.append("all recordings that train agree on it: the laws are not complete")
    decided = replace(
        quiet, kind="missing_physics" if answer in ("exact", "approximate", "family")
        else "unknown_physics",
        chosen=chosen.trial, same_place=same, rivals=tuple(s.trial for s in others),
        share=float(np.clip(share, 0.0, 1.0)), reasons=tuple(reasons), richer=richer,
        answer=answer,
        physics=plainest(physics if answer == "family" or len(physics) == 1 else ()),
        places=places,
        law_fit=fit, kinds=shown,
    )  # fmt: skip
    return replace(decided, confidence=probability(decided))


BARE = 1.2
"""Times a measured noise above which an exact law may still leave something."""


def _attached(law: Scored, e: Evidence) -> list[str]:
    """Places that look the same, where a form of a law's kind explains about as much as the law."""
    own, best = law.trial.insertion.kind, best_of([law, *e.kinds])
    assert best is not None
    least = explained(law, e.plain, best.score) - LIKE
    return [
        k.element for k in e.kinds
        if k.kind == own and together(k.element, law.element, e.classes)
        and explained(k, e.plain, best.score, usual=True) > least
    ]  # fmt: skip


def _ahead(chosen: Scored, e: Evidence, t: Thresholds) -> list[Candidate]:
    """Laws elsewhere that do better than one that is not quite right itself.

    They may lie outside the range in which they are what their names say, or at places whose forms
    do less: nothing to be named, but neither is what lags behind them. Where the named law leaves
    much, a good law elsewhere is rather a second effect.
    """
    quiet = chosen.left.most <= t.noise
    return [
        s.trial for s in e.laws
        if s.element != chosen.element and s.score.loss < chosen.score.loss
        and s.trial.effect != UNNAMED.name and (quiet or not s.trial.itself)
    ]  # fmt: skip


def _beyond(chosen: Scored, e: Evidence) -> list[Scored]:
    """Richer laws at the same place that do better, though outside what their names say.

    What the simple law lacks is there, whichever of its family has it.
    """
    nested = richer_names(chosen.trial, [s.trial for s in e.laws])
    return [
        s for s in e.laws
        if s.trial.effect in nested and s.element == chosen.element and not s.trial.itself
        and s.trial.home and not s.idle and chosen.score.behind(s.score) > DOUBT
    ]  # fmt: skip


def _imitated(chosen: Scored, e: Evidence) -> list[Scored]:
    """Laws of the model's own quantities that a mere course in time may imitate.

    What shows in few stretches looks like a push from outside, however exactly that one fits.
    """
    if chosen.trial.insertion.kind not in SHAPELESS or e.plain.paired(chosen.score) > SELDOM:
        return []
    where = {chosen.element, *e.located}
    return [
        s for s in e.laws
        if s.trial.effect != UNNAMED.name and s.trial.itself and not s.idle
        and (s.element in where or together(s.element, chosen.element, e.classes))
        and s.trial.home and s.trial.insertion.kind not in ANYTHING
        and explained(s, e.plain, chosen.score) > UNUSUAL
    ]  # fmt: skip


SELDOM = 2.0
"""Standard errors by which stretches agree, all alike, if four of forty tell all there is."""


def _answer(chosen: Scored, others: Sequence[Scored], fit: float) -> str:
    if not others:
        # a course in time says that a value changes, not what changes it
        caused = chosen.trial.insertion.kind != "time"
        return "exact" if caused and fit >= EXACT else "approximate"
    # one lag is one idea, before the machine as behind it
    laws = {s.trial.insertion.law for s in (chosen, *others)}
    families = {chosen.trial.insertion.family, *(s.trial.insertion.family for s in others)}
    if len(families) == 1 and all(s.element == chosen.element for s in others):
        return "family"
    return "look_alikes" if len(laws) <= MOST else "unknown"


def _simplest(law: Scored, alike: Sequence[Scored]) -> Scored:
    """Return a simpler law at the same place that the data do not tell from the best."""
    for name in law.trial.insertion.simpler:
        for s in alike:
            if s.trial.effect == name and law.trial.insertion.contains(s.trial.insertion):
                return _simplest(s, alike)
    return law


def _without_idle(law: Scored, laws: Sequence[Scored], e: Evidence, t: Thresholds) -> Scored:
    """Return the simpler law in place of one whose own part may be zero, if it explains as much.

    Sub-steps and kinks let two fits of one law differ by more than noise: what is left as noise by
    either is not told apart by that, and both are a family then.

    An interval that holds zero where the simpler law lags far behind is that of a shape which the
    readings do not tell, not of a part that is not there.
    """
    for s in laws:
        if not law.trial.insertion.contains(s.trial.insertion):
            continue
        idle = law.idle and s.score.behind(law.score) < IDLE * t.z
        noise = idle or s.left.most <= t.noise
        if noise and explained(s, e.plain, law.score) >= (EXACT if idle else ALL_BUT):
            return s
    return law


IDLE = 2.0
"""Times the limit up to which a simpler law may lag behind one whose own part may be zero."""


ALL_BUT = 0.999
"""Part that a simpler law explains of what a richer one does if the rest may be of the numerics."""


def richer_names(best: Candidate, trials: Sequence[Candidate]) -> set[str]:
    """Names of effects among `trials` that contain the best one as a special case."""
    return {
        x.effect for x in trials
        if x.effect != UNNAMED.name and best.effect in x.insertion.simpler
        and not best.insertion.form
    }  # fmt: skip
