"""Second proof: what is said when the true law is not in the catalogue.

For every recording with one effect of the catalogue the diagnosis runs again without the true
effect and without every law that contains it. Right is "unknown" or the family; the place must be
right or left open.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from bondgraph.support.whole_file import write_atomically
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.report.tables import markdown
from tests.proof.trial.answers import Answer
from tests.proof.trial.gates import Gate, at_least, at_most
from tests.proof.trial.layout import Layout
from tests.proof.trial.matching import Outcome, judge
from tests.proof.trial.nesting import containing
from tests.proof.trial.oracles import OracleAnswer
from tests.proof.trial.rates import rate
from tests.proof.trial.running import Progress, answer, run_all
from tests.proof.trial.scoring import rate_row
from tests.proof.trial.summary import gates_table
from tests.proof.trial.truths import Public, Truth


@dataclass(frozen=True, slots=True)
class _Without:
    """Work for one recording; travels to the processes."""

    truths: Mapping[str, Truth]

    def __call__(self, layout: Layout, public: Public, seed: int) -> dict[str, Any]:
        """Diagnose without the true law."""
        (effect,) = self.truths[public.id].effects
        names = containing(effect.effect)
        return answer(layout, public, seed, DiagnosisOptions(jobs=1, without=names)) | {
            "without": list(names)
        }


def run_withheld(
    layout: Layout,
    public: Sequence[Public],
    truths: Mapping[str, Truth],
    *,
    jobs: int = -1,
    seed: int = 0,
    progress: Progress | None = None,
) -> int:
    """Diagnose every recording with one effect without its law; resumes."""
    asked = [p for p in public if truths[p.id].cell == "single"]
    return run_all(
        layout, asked, layout.withheld, _Without(truths), jobs=jobs, seed=seed, progress=progress
    )


@dataclass(frozen=True, eq=False)
class Withheld:
    """Score of the second proof.

    Attributes
    ----------
    outcomes : tuple of Outcome
        In ``Outcome.name``, ``family`` and ``unknown`` are right, ``missed`` is silent.
    """

    outcomes: tuple[Outcome, ...]
    gates: tuple[Gate, ...]

    @property
    def passed(self) -> bool:
        """Every gate is met; where there was nothing to count, it is not."""
        return all(g.passed for g in self.gates if g.gated)


def score_withheld(
    truths: Mapping[str, Truth],
    answers: Mapping[str, Answer],
    oracles: Mapping[str, OracleAnswer] | None = None,
) -> Withheld:
    """Score answers that were given without the true law.

    Rates of names and places are taken over the recordings in which something was said to be
    missing and, of all, with silence counted as not naming wrongly; both are printed.
    """
    outcomes = tuple(
        judge(truths[i], answers[i])
        for i in sorted(truths)
        if truths[i].cell == "single" and i in answers
    )
    loud = [o for o in outcomes if o.answer.alarm]
    shown = [
        o
        for o in outcomes
        if (oracle := (oracles or {}).get(o.truth.id)) is not None and oracle.detectable
    ]
    honest = {"family", "unknown"}
    return Withheld(
        outcomes,
        (
            at_least("unknown or the right family, where something was said",
                     rate(o.name in honest for o in loud), 0.95),
            at_least("right class of ports or unresolved, where something was said",
                     rate(o.place in ("right", "unresolved", "none") for o in loud), 0.97),
            at_most("wrong class of ports, where something was said",
                    rate(o.place == "wrong" for o in loud), 0.03),
            at_least("unknown, the right family or silence, of all",
                     rate(o.name in honest | {"missed"} for o in outcomes), 0.95, gated=False),
            at_least("something said, where the effect shows (3 dB)",
                     rate(o.answer.alarm for o in shown), 0.95, gated=False),
            at_most("recordings without an answer",
                    rate(bool(o.answer.error) for o in outcomes), 0.0),
        ),
    )  # fmt: skip


def publish_withheld(found: Withheld, folder: Path) -> Path:
    """Write ``WITHHELD.md`` and ``withheld.json``; returns the path of the former."""
    listed = [
        (
            o.truth.id,
            o.truth.plant,
            f"{o.truth.effects[0].effect} at {o.truth.effects[0].element}",
            o.named,
            o.placed,
            o.name,
            o.place,
        )
        for o in found.outcomes
    ]
    head = ("recording", "plant", "concealed", "said", "places", "name", "place")
    parts = [
        "# The truth withheld",
        f"{len(found.outcomes)} recordings with one effect, each diagnosed without the true law "
        "and without every law that contains it. "
        + ("All gates are met." if found.passed else "**Not all gates are met.**"),
        gates_table(found.gates),
        markdown(head, listed),
    ]
    rates = [asdict(g) | {"counted": rate_row(g.counted), "passed": g.passed} for g in found.gates]
    clean = json.dumps(
        {"gates": rates, "recordings": [dict(zip(head, r, strict=True)) for r in listed]}, indent=1
    ).replace("NaN", "null")
    write_atomically(folder / "withheld.json", clean + "\n")
    target = folder / "WITHHELD.md"
    write_atomically(target, "\n\n".join(parts) + "\n")
    return target
