"""Whether the place of a law stands: beside forms at other places, and the same law elsewhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.diagnosis.evidence.hypotheses import Evidence, Scored, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.kinds_told import EXACT, FAR, SHAPELESS
from identification.diagnosis.evidence.shares import ANYTHING, explained, together
from identification.diagnosis.search.candidates import Candidate

LAGS = 2.0
"""Times the limit by which a law lags too far behind another, or a form, to stay beside it."""


def admissible(
    laws: Sequence[Scored], kinds: Sequence[KindScore], e: Evidence, t: Thresholds
) -> list[Scored]:
    """Leave out laws at places that are out of question, whatever law sits there.

    A flexible form at another place does better than the law, and no form at its own place does as
    well as that. Where the readings cannot tell the two places apart, a law that explains as much
    as the form stays, unless it lags far behind it and the form at its own place is no worse than
    the law: then forms tell the places apart.
    """
    if not kinds:
        return list(laws)
    best, where = kinds[0], {k.element for k in kinds}

    def asked(s: Scored) -> bool:
        alike = any(together(k.element, s.element, e.classes) for k in kinds)
        near = s.score.behind(best.score) < LAGS * t.z
        follows = any(k.score.behind(s.score) < FAR * t.z for k in _own(s, e))
        out = follows and not near
        return alike and not out and explained(s, e.plain, best.score) >= EXACT

    return [
        s for s in laws
        if s.element in where or s.score.behind(best.score) < t.z or asked(s)
    ]  # fmt: skip


def borne_elsewhere(law: Scored, e: Evidence, t: Thresholds) -> bool:
    """Whether the form of a law's kind at its place does far worse, and one elsewhere as well.

    A form follows any law of its kind: one that it cannot follow there imitates something else. Not
    so a free course in time, which nothing tells in a stretch left out, and a distortion of a
    command, which has no past. Nor a linear element whose lack was the whole misfit: forms answer
    through the model without it, which rings or drifts where the machine does not. Nor a richer
    memory, which may have been loaded beforehand: free forms have no past.
    """
    made = law.trial.insertion
    past = made.form and made.kind == "memory"
    if (made.plain or past) and law.left.is_noise(t.noise):
        return False
    own = (k for k in _own(law, e) if k.kind not in (*SHAPELESS, "command"))
    far = any(FAR * t.z < k.score.behind(law.score) < np.inf for k in own)
    return far and any(
        k.element != law.element and k.score.behind(law.score) < t.z for k in e.kinds
    )


def outdone_elsewhere(law: Scored, e: Evidence, lead: float) -> bool:
    """Whether a form elsewhere leads a law by so many errors and leaves less than half its rest."""
    least = HALF * (law.score.square - 1.0)
    return any(
        k.element != law.element and k.kind not in ANYTHING
        and k.score.square - 1.0 < least and law.score.behind(k.score) > lead
        for k in e.kinds
    )  # fmt: skip


HALF = 0.5
"""Part of what a law leaves that something elsewhere leaves if the law is not what is missing."""


def also_there(law: Scored, e: Evidence, t: Thresholds) -> tuple[Candidate, ...]:
    """Return the same law at other places that stay in question though they are no equals.

    Where it does as well outside what its name says: it may be another law there, that the place is
    open is sure. And where the readings tell no places apart and both leave noise: two fits differ
    by more than that, so that a lag of twice the limit decides nothing.
    """

    def in_question(s: Scored) -> bool:
        lag = s.score.behind(law.score)
        if not s.trial.itself:
            return 0 <= lag < t.z
        alike = together(s.element, law.element, e.classes)
        quiet = max(s.left.most, law.left.most) <= t.noise
        return alike and quiet and t.z <= lag < LAGS * t.z

    return tuple(
        s.trial for s in e.laws
        if s.trial.effect == law.trial.effect and s.element != law.element and s.trial.home
        and in_question(s)
    )  # fmt: skip


def _own(law: Scored, e: Evidence) -> list[KindScore]:
    """Return the form of a law's kind at its own place."""
    here = (law.element, law.trial.insertion.kind)
    return [k for k in e.kinds if (k.element, k.kind) == here]
