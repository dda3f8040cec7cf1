"""Second proof: what is said when the true law is not in the catalogue.

Recordings whose single effect was named rightly are diagnosed again without its law and without
every law that contains it. Right is a kind, a set, a family or "unknown"; another name is an error.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bondgraph.support.whole_file import write_atomically
from hardware.simulators.judging.claims import ExamAnswer
from hardware.simulators.judging.outcome import ExamOutcome, judge_exam
from hardware.simulators.judging.truths import ExamTruth
from tests.proof.exam.answering import exam_answer
from tests.proof.trial.gates import MISNAMED, Gate, withheld_gates
from tests.proof.trial.layout import Layout
from tests.proof.trial.nesting import containing
from tests.proof.trial.parts import Part, committed, gates_part
from tests.proof.trial.publishing import listing, markdown_of
from tests.proof.trial.rates import Rate, rate
from tests.proof.trial.running import Progress, run_all
from tests.proof.trial.scoring import gate_row, rate_row
from tests.proof.trial.truths import Public

MOST = 220
"""Recordings at most: enough for 5 % with five errors, and a third of an hour on two cores."""


@dataclass(frozen=True, slots=True)
class _Without:
    """Work for one recording; travels to the processes."""

    truths: Mapping[str, ExamTruth]

    def __call__(self, layout: Layout, public: Public, seed: int) -> dict[str, Any]:
        """Diagnose without the true law."""
        main = self.truths[public.id].main
        assert main is not None
        names = containing(main.effect)
        return exam_answer(layout, public, seed, names) | {"without": list(names)}


def to_withhold(
    truths: Mapping[str, ExamTruth], answers: Mapping[str, ExamAnswer], most: int = MOST
) -> tuple[str, ...]:
    """Return the recordings whose single effect was named rightly, at most so many.

    The hash of the id orders them: nobody picks.
    """
    judged = [judge_exam(t, answers[i]) for i, t in truths.items() if t.single and i in answers]
    right = [o.id for o in judged if o.truth.main in o.found]
    return tuple(sorted(right, key=lambda i: hashlib.sha256(i.encode()).hexdigest())[:most])


def run_withheld(
    layout: Layout,
    public: Sequence[Public],
    truths: Mapping[str, ExamTruth],
    asked: Sequence[str],
    *,
    jobs: int = -1,
    seed: int = 0,
    progress: Progress | None = None,
) -> int:
    """Diagnose every recording that is asked for without its law; resumes."""
    chosen = [p for p in public if p.id in set(asked)]
    work = _Without(truths)
    return run_all(layout, chosen, layout.withheld, work, jobs=jobs, seed=seed, progress=progress)


@dataclass(frozen=True, eq=False)
class Withheld:
    """Score of the second proof."""

    outcomes: tuple[ExamOutcome, ...]
    rates: Mapping[str, Rate]
    gates: tuple[Gate, ...]

    @property
    def passed(self) -> bool:
        """Every gate is met; where there was nothing to count, it is not."""
        return all(g.passed for g in self.gates)


def score_withheld(truths: Mapping[str, ExamTruth], answers: Mapping[str, ExamAnswer]) -> Withheld:
    """Score answers that were given without the true law; names the truth accepts are right."""
    outcomes = tuple(judge_exam(truths[i], answers[i]) for i in sorted(answers) if i in truths)

    def misnamed(o: ExamOutcome, answers: Sequence[str] = ("exact", "approximate")) -> bool:
        return any(c.name is False and c.claim.answer in answers for c in o.claims)

    rates = {
        MISNAMED: rate(map(misnamed, outcomes)),
        "another exact name": rate(misnamed(o, ("exact",)) for o in outcomes),
        "another name that the truth accepts": rate(
            any(c.exactly for c in o.claims) for o in outcomes
        ),
        "a set, or a family, that excludes the truth": rate(
            misnamed(o, ("look_alikes", "family")) for o in outcomes
        ),
        "said to miss something": rate(o.answer.alarm for o in outcomes),
        "right kind, of the kinds given": rate(
            c.kind is True for o in outcomes for c in o.claims if c.kind is not None
        ),
        "wrong places, of the places given": rate(
            c.place is False for o in outcomes for c in o.claims if c.place is not None
        ),
        "crashes": rate(o.outcome == "crash" for o in outcomes),
    }
    return Withheld(outcomes, rates, withheld_gates(rates))


def publish_withheld(found: Withheld, commitment: Mapping[str, Any], folder: Path) -> Path:
    """Write ``WITHHELD.md`` and ``withheld.json``; returns the path of the former."""
    listed = [
        (o.id, o.truth.plant, o.truth.words, o.answer.words, ", ".join(o.wrong))
        for o in found.outcomes
    ]
    head = ("recording", "plant", "concealed", "said", "wrong")
    pieces = [
        gates_part(found.gates),
        Part("Every rate", "", ("counted", "share"), [(k, str(r)) for k, r in found.rates.items()]),
        Part("Every recording", "", head, listed),
    ]
    said = (
        f"{len(found.outcomes)} recordings whose single effect was named rightly, each diagnosed "
        "again without the true law and without every law that contains it.\n\n"
        + listing(committed(commitment))
    )
    content = {
        "gates": [gate_row(g) for g in found.gates],
        "rates": {name: rate_row(r) for name, r in found.rates.items()},
        "each": [dict(zip(head, r, strict=True)) for r in listed],
    }
    write_atomically(folder / "withheld.json", json.dumps(content, indent=1) + "\n")
    target = folder / "WITHHELD.md"
    write_atomically(target, markdown_of("The truth withheld", said, pieces, {}))
    return target
