"""What would be said were the true law not in the catalogue, from stored evidence.

Of recordings whose single effect was named rightly the first decision is made again without the
true law and without every law that contains it. What the search would have tried instead is not
known, so this is no substitute for `tests.proof.trial.withheld`; it shows what knobs can do. A name
whose law leaves noise cannot be denied: nothing in the recording speaks against it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from hardware.simulators.judging.claims import exam_answer_of
from hardware.simulators.judging.outcome import judge_exam
from hardware.simulators.judging.truths import ExamTruth
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.decision import decide
from identification.diagnosis.evidence.hypotheses import Evidence, Thresholds
from tests.proof.exam.certifying import GRID
from tests.proof.exam.stored import evidence_of
from tests.proof.trial.nesting import containing
from tests.proof.trial.rates import Rate, rate

NAMES = ("exact", "approximate")


@dataclass(frozen=True, slots=True)
class Trade:
    """What knobs do to names without the true law, and to right names with it.

    Attributes
    ----------
    misnamed : Rate
        Another name than the true one, though the true one was not there to be given.
    undeniable : Rate
        Those of them whose law leaves noise.
    kept : Rate
        Right names, with the whole catalogue.
    """

    limits: Thresholds
    answers: tuple[str, ...]
    misnamed: Rate
    undeniable: Rate
    kept: Rate


def trades(
    truths: Mapping[str, ExamTruth], contents: Sequence[Mapping[str, Any]]
) -> Iterator[Trade]:
    """Count for all names, then for exact ones alone, the knobs in use first."""
    asked = [(truths[str(c["id"])], _first(c)) for c in contents if _named(truths, c)]
    for answers in (NAMES, NAMES[:1]):
        for limits in reversed(GRID):
            wrong = [_misnamed(t, e, limits, answers) for t, e in asked]
            yield Trade(
                limits, answers, rate(w is not None for w in wrong), rate(w is True for w in wrong),
                rate(_right(t, decide(e, limits), answers) for t, e in asked),
            )  # fmt: skip


def withheld_lines(
    truths: Mapping[str, ExamTruth], contents: Sequence[Mapping[str, Any]]
) -> list[str]:
    """Return a line for each setting of the knobs."""
    return [
        f"z {x.limits.z:g}, law {x.limits.law:g}, {' and '.join(x.answers):21s}"
        f"  misnamed {x.misnamed!s:24s}  of them leave noise {x.undeniable!s:24s}"
        f"  right names kept {x.kept}"
        for x in trades(truths, contents)
    ]


def _named(truths: Mapping[str, ExamTruth], content: Mapping[str, Any]) -> bool:
    truth = truths.get(str(content["id"]))
    if truth is None or not truth.single or not content.get("evidence"):
        return False
    return truth.main in judge_exam(truth, exam_answer_of(content)).found


def _first(content: Mapping[str, Any]) -> Evidence:
    return evidence_of(content["evidence"][0])


def without(e: Evidence, effect: str) -> Evidence:
    """Return evidence without an effect and all that contain it."""
    out = set(containing(effect))
    return replace(e, laws=tuple(s for s in e.laws if s.trial.effect not in out))


def _misnamed(
    truth: ExamTruth, e: Evidence, limits: Thresholds, answers: Sequence[str]
) -> bool | None:
    """Whether the law of a wrong name leaves noise; None where no wrong name is given."""
    assert truth.main is not None
    left = without(e, truth.main.effect)
    decided = decide(left, limits)
    if not _gives(decided, answers) or _right(truth, decided, answers):
        return None
    law = next(s for s in left.laws if s.trial is decided.chosen)
    return law.left.is_noise(limits.noise)


def _gives(decided: Decision, answers: Sequence[str]) -> bool:
    return decided.kind == "missing_physics" and decided.answer in answers


def _right(truth: ExamTruth, decided: Decision, answers: Sequence[str]) -> bool:
    chosen = decided.chosen
    if chosen is None or not _gives(decided, answers):
        return False
    return any(chosen.effect in x.names for x in truth.effects)
