"""What part of the misfit a hypothesis explains, and which places look the same."""

from __future__ import annotations

import numpy as np

from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.hypotheses import Evidence, Hypothesis, Scored
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.localisation.structural_classes import Isolability


def explained(h: Hypothesis, plain: BlockScore, best: BlockScore, *, usual: bool = False) -> float:
    """Part of what the best of all explains that one explains, unusual kinds discounted."""
    part = 1.0 - h.score.excess(best) / max(plain.excess(best), 1e-12)
    discounted = isinstance(h, KindScore) and h.kind in ANYTHING and not usual
    return part * (UNUSUAL if discounted else 1.0)


UNUSUAL = 0.85
"""Weight of what a form explains that may depend on anything."""


ANYTHING = ("sensing", "time", "exogenous")
"""Kinds that depend on what is measured, reading or input, or on time alone."""


def law_fit(law: Scored, kind: KindScore, e: Evidence) -> float:
    """Part of what a kind explains that a law explains too, 0 .. 1."""
    whole = e.plain.excess(kind.score)
    return float(np.clip(1.0 - law.score.excess(kind.score) / max(whole, 1e-12), 0.0, 1.0))


def together(one: str, other: str, classes: Isolability | None) -> bool:
    """Whether the readings cannot tell two places apart, whatever the law."""
    return one == other or (classes is not None and other in classes.class_of(one))
