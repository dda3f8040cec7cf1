"""Which of the kinds in question foretells samples that no fit has seen.

Forms with many weights follow a stretch whatever made it; a law with few numbers that holds in
another stretch does not by accident. Where one law in question foretells what is held out, and none
of another kind or at another place comes near, only its kind at its place is left in question.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.evidence.hypotheses import Evidence, Scored, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.kinds_told import CURVES, RICHER
from identification.diagnosis.evidence.shares import together
from identification.report.numbers import times_noise

FORETOLD = 0.1
"""Part of the held-out misfit that a law leaves at most if it foretells it."""
REFUTED = 4.0
"""Times more of its mean square that a refuted law leaves on held-out samples."""


def foretold(
    kinds: Sequence[KindScore], e: Evidence, t: Thresholds
) -> tuple[list[KindScore], Evidence, Scored, str] | None:
    """Return the kinds that are left, their evidence, the law, and a reason; None where all are.

    Only the first effect is asked for: what one leaves may be of another one in either part.
    """
    if e.named or e.located or e.nominal <= t.noise**2:
        return None
    able = [
        s for s in e.laws
        if s.trial.effect != UNNAMED.name and s.trial.itself and e.plain.behind(s.score) > t.z
        and s.trial.test <= FORETOLD * e.nominal and _held_by(s, kinds)
    ]  # fmt: skip
    if not able:
        return None
    best = min(able, key=lambda s: s.trial.test)
    own, place = best.trial.insertion.kind, best.element

    def alike(s: Scored) -> bool:
        unnamed = s.trial.effect == UNNAMED.name
        return together(s.element, place, e.classes) and (unnamed or s.trial.insertion.kind == own)

    rivals = [s for s in e.laws if not alike(s)]
    here = next((k for k in e.kinds if k.element == place and k.kind == own), None)
    near = min((s.trial.test for s in rivals), default=0.0)
    if here is None or near <= REFUTED * best.trial.test:
        return None
    left = [here, *(k for k in kinds if k is not here and k in _held_by(best, kinds))]
    reason = (
        f"{best.trial.label} foretells the held-out samples (to {times_noise(best.trial.test):.3g} "
        f"times the noise, without it {times_noise(e.nominal):.3g}), no law of another kind or "
        f"place does ({times_noise(near):.3g} at least)"
    )
    return left, replace(e, laws=tuple(s for s in e.laws if alike(s))), best, reason


def _held_by(law: Scored, kinds: Sequence[KindScore]) -> list[KindScore]:
    """Return the kinds in question at the place of a law that are its own or hold it."""
    own = law.trial.insertion.kind
    holding = (own, *(RICHER if own in CURVES else ()))
    return [k for k in kinds if k.element == law.element and k.kind in holding]
