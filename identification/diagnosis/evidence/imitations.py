"""What only seems to be found: noise with a memory, and courses in time beside a law's rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.hypotheses import Evidence, Hypothesis, Scored, Thresholds
from identification.diagnosis.evidence.kinds_told import SHAPELESS, best_of
from identification.diagnosis.evidence.shares import ANYTHING


def shows(plain: BlockScore, best: BlockScore, t: Thresholds) -> bool:
    """Whether a hypothesis improves on the model as it is, surely and by enough."""
    return plain.behind(best) > t.z and plain.excess(best) > t.gain


def without_imitations(e: Evidence, t: Thresholds) -> tuple[Evidence, str]:
    """Return the evidence without courses in time that a freer law outdoes, and why; "" if none."""
    outdone = [s for s in e.laws if any(_outdone(s, law, e, t) for law in e.laws)]
    if not outdone:
        return e, ""
    reason = OUTDONE.format(", ".join(s.trial.label for s in outdone))
    return replace(e, laws=tuple(s for s in e.laws if s not in outdone)), reason


def _outdone(course: Scored, law: Scored, e: Evidence, t: Thresholds) -> bool:
    """Whether a mere course in time, in any form, does less than a freer form of a law near it.

    It lies near a law that is not quite right only because either leaves something; what it leaves
    goes with another form of that law, and with no other course.
    """
    own, kind = course.trial.insertion.kind, law.trial.insertion.kind
    able = law.trial.itself and law.trial.effect != UNNAMED.name and kind not in ANYTHING
    if own not in SHAPELESS or not able:
        return False
    if not (abs(law.score.behind(course.score)) < t.z and shows(e.plain, law.score, t)):
        return False
    courses = [k for k in e.kinds if k.element == course.element and k.kind == own]
    best = best_of([course, *courses])
    assert best is not None
    forms = [k for k in e.kinds if k.element == law.element and k.kind == kind]
    return any(best.score.behind(k.score) > t.z for k in forms)


OUTDONE = "a freer form of a law near it explains more than any course in time: {}"


ONCE = 1.1
"""Standard errors by which stretches agree if one of them tells all there is: one, at most."""


def as_coloured(found: Sequence[Hypothesis], e: Evidence, t: Thresholds) -> bool:
    """Whether noise with a memory explains as well whatever improves what may be noise.

    What shows in one stretch alone is no noise of the whole record.
    """
    leading = [h.score for h in found if shows(e.plain, h.score, t)]
    if any(e.plain.paired(s) < ONCE for s in leading):
        return False
    return all(s.foretold > SEEN and e.plain.beside_colour(s) <= BESIDE * t.z for s in leading)


SEEN = 0.05
"""Share of what is left that its own past must foretell to be coloured."""
BESIDE = 4.0 / 3.0
"""Times the limit of the set by which something has to lead beside noise with a memory: the best of
a hundred forms that follow such noise leads by that limit now and then."""
