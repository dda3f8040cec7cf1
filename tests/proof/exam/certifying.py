"""The knobs of the decision by Learn-then-Test, and what its answers were worth.

Stored evidence is decided again with more cautious knobs, from those that abstain most to those
in use; the walk goes on as long as every gate is certified: were the true rate as high as the
limit, so few errors would come with a probability below 5 % (Angelopoulos et al., Learn then test,
Ann. Appl. Stat. 19 (2025) 1641). A finding whose decision changes is taken back; the others stand
as they were told, because what a search would have done after another decision is not known.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput
from hardware.simulators.judging.claims import Claim, ExamAnswer, exam_answer_of
from hardware.simulators.judging.truths import ExamTruth
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.decision import decide
from identification.diagnosis.evidence.hypotheses import Thresholds
from tests.proof.exam.counting import score_exam
from tests.proof.exam.stored import evidence_of
from tests.proof.trial.gates import LEVEL
from tests.proof.trial.rates import Rate, rate

GATES: Mapping[str, float] = {
    "false alarms, of the controls": 0.02,
    "called explained, of those where an effect shows": 0.02,
    "wrong names, of the names given": 0.02,
    "wrong places, of the places given": 0.03,
    "outside the catalogue named exactly": 0.05,
}
"""Rates that are limited, and the limits."""

SHARP = "sharp: right name at the right place"

GRID = (
    *(
        Thresholds(z=z, law=law)
        for z, law in ((8.0, 0.99), (6.0, 0.98), (5.0, 0.97), (4.0, 0.96), (3.5, 0.95))
    ),
    Thresholds(),
)
"""Knobs from the most cautious to those in use."""

NOTHING = frozenset[str]()
UNTOLD = Claim("unknown", "", "", "", NOTHING, NOTHING, NOTHING, NOTHING, resolved=False)
"""That something is missing, and no more."""


@dataclass(frozen=True, slots=True)
class Setting:
    """What some knobs would have led to."""

    limits: Thresholds
    rates: Mapping[str, Rate]

    def p(self, gate: str) -> float:
        """Probability of so few errors if the true rate were the limit."""
        return self.rates[gate].p_at_most(GATES[gate])

    @property
    def certified(self) -> bool:
        """Whether every gate is."""
        return all(self.p(gate) < LEVEL for gate in GATES)


def replayed(content: Mapping[str, Any], limits: Thresholds) -> ExamAnswer:
    """Return the answer that is left of a stored one with more cautious knobs."""
    answer = exam_answer_of(content)
    evidence = [evidence_of(e) for e in content.get("evidence", ())]
    pairs = [(decide(e), decide(e, limits)) for e in evidence]
    lost = [usual for usual, found in pairs if not _same(usual, found)]
    if not lost or not answer.alarm:
        return answer
    kept = tuple(c for c in answer.claims if c.named and not any(_states(c, d) for d in lost))
    told = any(c.answer == "kind" for c in answer.claims) and _same(*pairs[0])
    if told or kept:
        return answer if told else replace(answer, claims=kept)
    return replace(answer, verdict="unknown_physics", claims=(UNTOLD,))


def _same(a: Decision, b: Decision) -> bool:
    def said(d: Decision) -> tuple[Any, ...]:
        label = "" if d.chosen is None else d.chosen.label
        return d.kind, d.answer, label, d.places, d.physics, len(d.rivals)

    return said(a) == said(b)


def _states(claim: Claim, d: Decision) -> bool:
    """Whether a claim is what a decision said."""
    if d.chosen is None:
        return False
    placed = d.chosen.element in claim.places or d.chosen.effect == "clock_skew"
    return placed and (d.chosen.effect in claim.names or d.chosen.insertion.family == claim.family)


def settings(
    truths: Mapping[str, ExamTruth], contents: Sequence[Mapping[str, Any]]
) -> Iterator[Setting]:
    """Score every setting of the grid, the most cautious first."""
    for limits in GRID:
        answers = {str(c["id"]): replayed(c, limits) for c in contents}
        yield Setting(limits, score_exam(truths, answers).rates)


def read_contents(folder: Path) -> list[dict[str, Any]]:
    """Read answers with their evidence.

    Raises
    ------
    UnusableInput
        The folder is missing.
    """
    if not folder.is_dir():
        raise UnusableInput(f"{folder}: no answers here; run python -m tests.proof.exam run first")
    return [json.loads(p.read_text(encoding="utf-8")) for p in sorted(folder.glob("*.json"))]


def certify_lines(
    truths: Mapping[str, ExamTruth], contents: Sequence[Mapping[str, Any]]
) -> list[str]:
    """Return the walk along the grid, and how often each sort of answer was right."""
    lines, best, walking = [], None, True
    for s in settings(truths, contents):
        lines.append(f"z {s.limits.z:g}, law {s.limits.law:g}   sharp {s.rates[SHARP]}")
        for gate, limit in GATES.items():
            lines.append(
                f"   {gate:52s} {s.rates[gate]!s:28s} limit {100 * limit:g} %, p {s.p(gate):.3g}"
            )
        walking = walking and s.certified
        best = s if walking else best
    said = "none: too few answers or too many errors"
    if best is not None:
        said = f"z {best.limits.z:g}, law {best.limits.law:g}"
    lines.append(f"boldest setting with every gate certified at {100 * LEVEL:g} %: {said}")
    return [*lines, "", *right_lines(truths, contents)]


def right_lines(
    truths: Mapping[str, ExamTruth], contents: Sequence[Mapping[str, Any]]
) -> list[str]:
    """Return how often each sort of answer was right: what the stated probability is read from."""
    answers = {str(c["id"]): exam_answer_of(c) for c in contents}
    judged = score_exam(truths, answers).outcomes
    sorts: dict[str, list[bool]] = {}
    for o in judged:
        for c in o.claims:
            if c.claim.named:
                right = c.name is True and c.place is not False and not o.truth.empty
            elif c.claim.answer == "kind":
                right = c.kind is True and c.place is not False
            else:
                continue
            sorts.setdefault(c.claim.answer, []).append(right)
    return [
        f"{sort:12s} right {rate(found)!s:28s} stated {stated(rate(found)):.3f}"
        for sort, found in sorted(sorts.items())
    ]


def stated(found: Rate) -> float:
    """Return the share right by Laplace's rule: one right and one wrong more than were seen."""
    return (found.hits + 1) / (found.total + 2)
