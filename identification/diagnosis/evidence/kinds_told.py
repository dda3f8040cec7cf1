"""Which kinds of physics explain alike, and what of kind and place can be told of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.evidence.answer import Decision, probability
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.hypotheses import Evidence, Hypothesis, Scored, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.shares import ANYTHING, explained, law_fit, together
from identification.report.numbers import sureness

EXACT = 0.97
"""Part of what its kind explains from which a law is called exact."""


PLACES = 5
"""More places than this are no answer."""


def kinds_alike(
    e: Evidence, best: BlockScore, t: Thresholds, *, told: bool = False
) -> list[KindScore]:
    """Kinds that explain about as much as the best of them, that one first.

    Forms are no laws: how closely splines follow what is there is no evidence for a kind, so a part
    of the gain is allowed where even the best leaves more than noise.

    A form that may depend on anything explains most by itself, so what it explains is discounted:
    it stands for its kind only where the usual ones clearly do less.

    Parameters
    ----------
    told : bool
        No law fits, so that forms alone decide: that part is allowed beside noise, too.
    """
    # forms that were held against the true course of what was added need no discount
    part = {id(k): explained(k, e.plain, best, usual=e.along) for k in e.kinds}
    ranked = sorted(e.kinds, key=lambda k: -part[id(k)])
    if not ranked:
        return []
    top = ranked[0]
    left = told or float(top.score.noise.max()) > t.noise
    least = part[id(top)] - (0.0 if not left else CLOSE if e.along else LIKE)

    def imitates(k: KindScore) -> bool:
        """Whether it may depend on anything, and yet explains no more at the same place."""
        here = k.element == top.element and k.kind in ANYTHING and top.kind not in ANYTHING
        return here and explained(k, e.plain, best, usual=True) <= part[id(top)]

    return [
        k
        for k in ranked
        if not imitates(k)
        if k is top
        or part[id(k)] > max(least, part[id(top)] - PLAIN)
        or (part[id(k)] > least and k.score.behind(top.score) < FAR * t.z)
        or 0 <= k.score.behind(top.score) < t.z
        or (k.element == top.element and k.kind in CURVES and part[id(k)] > part[id(top)] - PLAIN)
    ]


def alike_kinds(e: Evidence, limits: Thresholds) -> list[KindScore]:
    """Kinds and places that one decision has to choose from, the likeliest first."""
    e = e.here
    best = best_of([*e.laws, *e.kinds])
    return [] if best is None else kinds_alike(e, best.score, limits)


RICHER = ("surface", "memory")
"""Kinds that hold a curve of one variable as a special case."""


SHAPELESS = ("time", "exogenous")
"""Kinds that are a course in time and nothing else."""


CLEAR = 2.0
"""Times the limit of the set by which a form that may follow anything has to lead."""


LIKE = 0.05
"""Part of the gain by which forms may differ through their columns alone."""


FAR = 4.0
"""Times the limit of the set by which one that differs by more than `PLAIN` lags too far."""


CLOSE = 0.03
"""The same of forms that were held against the true course of what was added."""


PLAIN = 0.01
"""The same however surely the other one leads, and of a curve beside a richer form there."""


def best_of(found: Sequence[Hypothesis]) -> Hypothesis | None:
    """Return the hypothesis that predicts best."""
    return min(found, key=lambda h: h.score.loss) if found else None


def kind_told(
    quiet: Decision, e: Evidence, kinds: Sequence[KindScore], law: Scored | None, t: Thresholds
) -> Decision:
    """No law fits: tell the kind and the place, as far as the set agrees on them."""
    kind = kinds[0]
    here = all(together(k.element, kind.element, e.classes) for k in kinds)
    # a law elsewhere that the data do not tell from the best form leaves the place open
    alike = [s for s in e.laws if 0 <= s.score.behind(kind.score) < t.z]
    open_places = {s.element for s in alike if s.trial.effect != UNNAMED.name}
    places = [k.element for k in kinds]
    physics = plainest(k.kind for k in kinds) if here else _common(kinds)
    if physics in ANYTHING and _follows_anything(kind, e, t):
        physics = ""
    if physics == "slow" and any(_as_clock(kind, k, t) for k in e.kinds):
        physics = ""
    # so does one with few numbers that explains nearly as much as a form with many
    near = {
        s.element for s in e.laws
        if s.trial.itself and s.trial.effect != UNNAMED.name
        and explained(s, e.plain, kind.score) >= EXACT
        and not together(s.element, kind.element, e.classes)
    }  # fmt: skip
    # and so does one that may follow anything and leads, whatever is discounted of its kind
    leading = {
        k.element for k in e.kinds
        if kind.score.behind(k.score) > t.z and not together(k.element, kind.element, e.classes)
    }  # fmt: skip
    open_places |= near | leading
    if len(set(places)) > PLACES or near or not (here or open_places <= set(places)):
        physics = ""
    if physics:
        places = _with_kind(physics, kinds, e)
    else:
        places += sorted(open_places)
    gain = e.plain.behind(kind.score)
    # a course that may follow anything follows a single push too, wherever that acted
    placed = len(set(places)) <= PLACES and (kind.kind not in ANYTHING or gain > CLEAR * t.z)
    if not placed:
        physics = ""
    reasons = [f"no law of the catalogue fits; {kind.label} does better, {sureness(gain)}"]
    fit = float("nan")
    if law is not None:
        fit = law_fit(law, kind, e)
        reasons.append(f"{law.trial.label} explains {100 * fit:.0f} % of what that explains")
    if len(kinds) > 1:
        reasons.append("these do as well: " + ", ".join(k.label for k in kinds[1:]))
    decided = replace(
        quiet, kind="unknown_physics", chosen=law.trial if law else None, law_fit=fit,
        reasons=(*quiet.reasons, *reasons), answer="kind" if physics else "unknown",
        physics=physics, places=tuple(dict.fromkeys(places)) if placed else (),
        kinds=tuple(kinds), share=0.0 if law is None else float(np.nan_to_num(fit)),
    )  # fmt: skip
    return replace(decided, confidence=probability(decided))


def _with_kind(physics: str, kinds: Sequence[KindScore], e: Evidence) -> list[str]:
    """Places of a kind: those in the set, then others that can have it and look the same.

    Where something from outside may act, any force or flow of the motion may be attached too; what
    changes in time may be the gain of a command.
    """
    found = [k.element for k in kinds if k.kind == physics]
    able = {physics, "exogenous"} if physics in ATTACHED else {physics}
    able |= {"command"} if physics == "time" else set()
    # one of the same kind that explains much less is another thing, wherever it sits; of other
    # kinds only the place counts, where the same could have been added
    best = kinds[0].score
    same = [
        k.element for k in e.kinds
        if k.kind in able and any(together(k.element, f, e.classes) for f in found)
        and (k.kind != physics or explained(k, e.plain, best, usual=True) > 0.5)
    ]  # fmt: skip
    # a coefficient of any course does not choose between places that the structure leaves open
    open_ones = e.located if physics == "time" else ()
    return list(dict.fromkeys([*found, *same, *open_ones]))


ATTACHED = ("restoring", "dissipative", "surface")
"""Kinds of what may be attached to a moving part or a store."""


def _common(kinds: Sequence[KindScore]) -> str:
    """Return the kind that is in question at every place, empty if there is no such one.

    Beside it stands nothing but what contains it, or the curve that a memory contains.
    """
    at = [{k.kind for k in kinds if k.element == p} for p in {k.element for k in kinds}]
    common = plainest(set.intersection(*at) & LOCAL)
    allowed = {common, *RICHER, *(CURVES if common in RICHER else ())}
    if kinds[0].kind in RICHER and kinds[0].kind != common and common not in CURVES:
        return ""  # neither of two rich ones holds the other
    return common if set.union(*at) <= allowed else ""


LOCAL = {"restoring", "dissipative", "memory", "ratio"}
"""Kinds that look otherwise at every port; slow ones look alike everywhere."""


def _follows_anything(kind: KindScore, e: Evidence, t: Thresholds) -> bool:
    """Whether a form explains much only because nothing contradicts it.

    One that takes any course in time has to leave nothing, unless it is a coefficient that changes
    along a motion that is known; one of the only reading stands for its kind where physics of the
    model explains less than half as much.
    """
    anything = kind.kind in SHAPELESS and not (e.along and kind.kind == "time")
    if anything and float(kind.score.noise.max()) > t.noise:
        return True
    usual = [explained(k, e.plain, kind.score) for k in e.kinds if k.kind not in ANYTHING]
    return len(e.before.over_noise) == 1 and max(usual, default=0.0) > 0.5


def _as_clock(kind: KindScore, course: KindScore, t: Thresholds) -> bool:
    """Whether a mere course in time of the same coefficient does clearly better."""
    same = course.kind == "time" and course.element == kind.element
    return same and kind.score.behind(course.score) > t.z


def follows_what_happened(course: Scored, e: Evidence, t: Thresholds) -> bool:
    """Whether what happened at its place explains a change as well as the clock does.

    A fluid that thins while it is sheared has a coefficient that changes; it is no drift.
    """
    return any(
        k.kind == "slow" and k.element == course.element and k.score.behind(course.score) < t.z
        for k in e.kinds
    )


CURVES = {"restoring", "dissipative"}
"""Kinds that are a curve of one variable: any other depends on more."""


def plainest(kinds: Iterable[str]) -> str:
    """Return the one kind among those alike, or the one curve that all richer ones contain.

    Empty if there is another kind among them.

    Examples
    --------
    >>> plainest(["surface", "restoring"]), plainest(["memory", "slow"])
    ('restoring', '')
    """
    found = set(kinds)
    left = found - set(RICHER) if len(found) > 1 else found
    return left.pop() if len(left) == 1 and (len(found) == 1 or left <= CURVES) else ""


def open_kinds(decision: Decision) -> tuple[KindScore, ...]:
    """Kinds and places among which the data do not choose, where neither name nor kind is told.

    Of each place the plainest kind if there is one; nothing where they are too many for an answer,
    where a law elsewhere leaves the place open, where one stands alone and yet was not told, or
    where all follow whatever is there.
    """
    untold = decision.kind == "unknown_physics" and decision.answer == "unknown"
    known = {k.element for k in decision.kinds}
    if not untold or not decision.places or not set(decision.places) <= known:
        return ()
    found: list[KindScore] = []
    for place in dict.fromkeys(k.element for k in decision.kinds):
        here = [k for k in decision.kinds if k.element == place]
        plain = plainest(k.kind for k in here)
        found += [k for k in here if k.kind == plain] if plain else here
    said = any(k.kind not in ANYTHING for k in found)
    return tuple(found) if said and 2 <= len(found) <= PLACES else ()
