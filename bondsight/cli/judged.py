"""A verdict beside the truth that was opened: whether it is right, in a word."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source, TwoPort, Valued
from bondgraph.graph.sensors import Sensor
from hardware.simulators.judging.claims import exam_answer_of
from hardware.simulators.judging.outcome import ExamOutcome, judge_exam
from hardware.simulators.judging.truths import ExamTruth
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.verdict.document import verdict

RESULTS = ("right", "look-alikes", "abstained", "missed", "wrong", "false alarm")


@dataclass(frozen=True)
class Outcome:
    """One recording's verdict beside its truth.

    Attributes
    ----------
    truth, said : str
        What was concealed and what was found, in a few words.
    result : str
        One of `RESULTS`: ``look-alikes`` is a set, a family or a name without a place that holds
        the truth; ``abstained`` says that something is missing, and nothing wrong of it.
    """

    plant: str
    effect: str
    truth: str
    said: str
    kind: str
    result: str
    confidence: float
    misfit_before: float
    misfit_after: float | None
    seconds: float


def places_of(graph: BondGraph) -> list[str]:
    """Return every element that may hold an effect."""
    return [e.name for e in graph.of_type(Valued, TwoPort, Source, Sensor)]


def judge(truth: ExamTruth, d: Diagnosis) -> Outcome:
    """Compare a verdict with the opened truth, by the judge of the sealed trial."""
    v, ports = verdict(d), places_of(d.graph)
    outcome = judge_exam(truth, exam_answer_of({"id": truth.id, "verdict": v, "ports": ports}))
    return Outcome(
        truth.plant,
        truth.effects[0].effect if truth.effects else "none",
        describe(truth),
        outcome.answer.words,
        v["verdict"],
        result_of(outcome),
        v["findings"][0]["confidence"] if v["findings"] else 0.0,
        d.nominal.chi2("test") if d.nominal else float("nan"),
        d.repaired.chi2("test") if d.repaired else None,
        d.seconds,
    )


def result_of(outcome: ExamOutcome) -> str:
    """Return the outcome as one of `RESULTS`."""
    if outcome.truth.empty:
        return "false alarm" if outcome.false_alarm else "right"
    if {"wrong name", "wrong place"} & set(outcome.wrong):
        return "wrong"
    if outcome.outcome == "right":
        return "right"
    if "wrong kind" in outcome.wrong:
        return "wrong"
    if outcome.outcome in ("name only", "set", "family"):
        return "look-alikes"
    return "abstained" if outcome.answer.alarm else "missed"


def describe(truth: ExamTruth) -> str:
    """Return what was concealed, in words."""
    said = [f"{e.effect} at {min(e.places)}{_size(e.moved)}" for e in truth.effects]
    return " and ".join(said) or "nothing was concealed"


def _size(moved: float) -> str:
    return f", which moves a reading by {moved:.2g} times the noise" if math.isfinite(moved) else ""


def summary(found: Sequence[Outcome], seconds: float) -> str:
    """Return counts, in total and by effect."""
    total = Counter(o.result for o in found)
    lines = [
        "",
        ", ".join(f"{k} {total[k]}" for k in RESULTS) + f" of {len(found)} in {seconds:.0f} s",
    ]
    for name in sorted({o.effect for o in found}):
        part = Counter(o.result for o in found if o.effect == name)
        lines.append(f"  {name:24s} " + ", ".join(f"{k} {part[k]}" for k in RESULTS if part[k]))
    return "\n".join(lines)
