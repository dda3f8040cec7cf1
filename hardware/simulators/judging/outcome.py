"""One answer beside its truth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from hardware.simulators.generator.families import FAMILY_OF
from hardware.simulators.judging.claims import Claim, ExamAnswer
from hardware.simulators.judging.truths import ConcealedEffect, ExamTruth

MISFIT = 3.0
"""A misfit that exceeds this many times the noise must not be called explained."""

SLIGHT = 0.3
"""Part of the noise below which a remaining misfit is none."""


@dataclass(frozen=True, slots=True)
class JudgedClaim:
    """One finding beside the truth; ``None`` where it says nothing of the sort.

    Attributes
    ----------
    name, place, kind : bool or None
        Whether the name (or the set, or the family), the place and the kind are right.
    about : tuple of ConcealedEffect
        The effects that it speaks of: those of its name, else those at its place, else all.
    """

    claim: Claim
    name: bool | None
    place: bool | None
    kind: bool | None
    about: tuple[ConcealedEffect, ...]

    @property
    def exactly(self) -> bool:
        """One name, and it is right."""
        return self.name is True and self.claim.answer in ("exact", "approximate")

    @property
    def holds(self) -> bool:
        """One name, and it is right, at no wrong place: of that its probability speaks."""
        return self.exactly and self.place is not False

    @property
    def pinned(self) -> bool:
        """One name, and it is right, at the right place."""
        return self.exactly and self.place is True


@dataclass(frozen=True, slots=True)
class ExamOutcome:
    """A recording's answer beside its truth."""

    truth: ExamTruth
    answer: ExamAnswer
    claims: tuple[JudgedClaim, ...]

    @property
    def id(self) -> str:
        """Id of the recording."""
        return self.truth.id

    @property
    def left(self) -> float:
        """The largest remaining misfit of the declared model, over the noise; nan if unknown."""
        return max(remaining(self.truth.noise, self.answer.nominal).values(), default=math.nan)

    @property
    def false_alarm(self) -> bool:
        """Something was said to be missing where nothing is."""
        return self.truth.empty and self.answer.alarm

    @property
    def misfit_explained(self) -> bool:
        """Nothing was said to be missing although the misfit is several times the noise."""
        return self.answer.reassuring and self.left > MISFIT

    @property
    def effect_explained(self) -> bool:
        """Nothing was said to be missing although an effect shows and is not fitted away."""
        return self.answer.reassuring and self.truth.shows and self.left > SLIGHT

    @property
    def found(self) -> frozenset[ConcealedEffect]:
        """Effects that were named rightly at the right place."""
        return frozenset(e for c in self.claims if c.pinned for e in c.about)

    @property
    def outside_named(self) -> bool:
        """Physics without a name was given one and no other."""
        return self.truth.outside and any(c.claim.answer == "exact" for c in self.claims)

    @property
    def wrong(self) -> tuple[str, ...]:
        """What was wrong, each in a word; empty if nothing was."""
        said = (
            ("crash", bool(self.answer.error) or not self.answer.verdict),
            ("false alarm", self.false_alarm),
            ("misfit called explained", self.misfit_explained),
            ("effect called explained", self.effect_explained),
            ("wrong name", not self.truth.empty and any(c.name is False for c in self.claims)),
            ("wrong place", not self.truth.empty and any(c.place is False for c in self.claims)),
            ("wrong kind", not self.truth.empty and any(c.kind is False for c in self.claims)),
            ("outside named", self.outside_named),
        )
        return tuple(word for word, bad in said if bad)

    @property
    def outcome(self) -> str:
        """One word for the count of the cells."""
        if self.answer.error or not self.answer.verdict:
            return "crash"
        if self.truth.empty:
            if self.answer.alarm:
                return "alarm"
            return "quiet" if self.answer.reassuring else "insufficient"
        if any(c.name is False for c in self.claims):
            return "wrong name"
        if any(c.place is False for c in self.claims):
            return "wrong place"
        if any(c.pinned for c in self.claims):
            return "right"
        for word, answers in (
            ("name only", ("exact", "approximate")), ("set", ("look_alikes",)),
            ("family", ("family",)), ("kind", ("kind",)),
        ):  # fmt: skip
            if any(c.claim.answer in answers for c in self.claims):
                return word
        if self.answer.alarm:
            return "placed" if any(c.place for c in self.claims) else "unknown"
        return "missed" if self.answer.reassuring else "insufficient"


def remaining(noise: Mapping[str, float], rms: Mapping[str, float]) -> dict[str, float]:
    """Return what is left of each reading beside its noise, over the noise.

    Examples
    --------
    >>> remaining({"x": 3.0}, {"x": 5.0})
    {'x': 1.3333333333333333}
    """
    return {k: math.sqrt(max(rms[k] ** 2 - s**2, 0.0)) / s for k, s in noise.items() if k in rms}


def judge_exam(truth: ExamTruth, answer: ExamAnswer) -> ExamOutcome:
    """Compare an answer with the truth of its recording."""
    return ExamOutcome(truth, answer, tuple(_judged(c, truth) for c in answer.claims))


def _judged(claim: Claim, truth: ExamTruth) -> JudgedClaim:
    name, spoken = _name(claim, truth)
    place = bool(_at(claim, spoken)) if claim.resolved and not truth.empty else None
    # of several effects of one name that at the place is meant
    about = _at(claim, spoken) or spoken
    kind = any(claim.kind in e.kinds for e in about) if claim.kind and about else None
    return JudgedClaim(claim, name, place, kind, about)


def _at(claim: Claim, effects: tuple[ConcealedEffect, ...]) -> tuple[ConcealedEffect, ...]:
    return tuple(e for e in effects if e.places & claim.places)


def _name(claim: Claim, truth: ExamTruth) -> tuple[bool | None, tuple[ConcealedEffect, ...]]:
    """Return whether the name is right, with the effects that it may speak of."""
    everything = truth.effects
    if not claim.named or truth.empty:
        return None, everything
    if claim.answer == "family":
        if truth.outside:
            return None, everything  # of what family it is cannot be judged
        kin = tuple(
            e for e in everything if claim.family in {FAMILY_OF[n] for n in e.names} | {e.family}
        )
        return bool(kin), kin or everything
    same = tuple(e for e in everything if e.names & claim.names)
    return bool(same), same or everything
