"""Laws that the screening passed over, and that the evidence asks for."""

from __future__ import annotations

from collections.abc import Sequence

from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.catalogue.effect import kind_at
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.hypotheses import Evidence, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.kinds_told import CURVES
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.score_test import Screened
from identification.diagnosis.search.candidates import Candidate


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


def overlooked(
    decision: Decision,
    kinds: Sequence[KindScore],
    trials: Sequence[Candidate],
    ranked: Sequence[Screened],
    classes: Isolability | None = None,
) -> list[Screened]:
    """Return laws that were not fitted though the evidence asks for them.

    Simpler forms of the best law, what the laws in question are confused with at their places, and,
    where no law could be named, laws of the kinds and places that the decision was left with; then
    any at places that the readings cannot tell from these.
    """
    done = {(t.effect, t.element) for t in trials}
    left = [s for s in ranked if (s.effect.name, s.element.name) not in done]
    chosen = decision.chosen
    found = [
        s for s in left
        if chosen is not None
        and s.element.name == chosen.element and s.effect.name in chosen.insertion.simpler
    ]  # fmt: skip
    found += [s for s in left if any(_confused(s, t) for t in decision.possible)]
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


def _confused(s: Screened, t: Candidate) -> bool:
    """Whether a law is known to look like another one at the same place."""
    told = s.effect.name in t.insertion.confused_with or t.effect in s.effect.confused_with
    return told and s.element.name == t.element and s.effect.name != UNNAMED.name


def _kinds_of(s: Screened) -> tuple[str, ...]:
    own = kind_at(s.effect.kind, s.element)
    return (own, "surface") if own in CURVES else (own,)


def elsewhere(
    decision: Decision, kinds: Sequence[KindScore], evidence: Evidence, ranked: Sequence[Screened]
) -> list[Screened]:
    """Return the law that is named at other places whose forms do as well, if not fitted there."""
    chosen = decision.chosen
    if chosen is None or decision.kind != "missing_physics":
        return []
    done = {s.element for s in evidence.laws if s.trial.effect == chosen.effect}
    alike = {(k.element, k.kind) for k in kinds if k.element not in done}
    return [
        s for s in ranked
        if s.effect.name == chosen.effect
        and any((s.element.name, kind) in alike for kind in _kinds_of(s))
    ]  # fmt: skip
