"""How often the missing element is found, and whether the interval of its coefficient holds it."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hardware.simulators.judging.claims import exam_answer_of
from hardware.simulators.judging.outcome import ExamOutcome, judge_exam
from tests.proof.lacking.answering import elements_of
from tests.proof.lacking.drawing import Lacking, beside, drawn, model_of, truth_of
from tests.proof.trial.layout import Layout
from tests.proof.trial.rates import Rate

LEFT_AT_NOISE = 1.1
"""What is left over the noise up to which a repair counts as whole."""


@dataclass(frozen=True)
class Asked:
    """One answer beside what is right.

    Attributes
    ----------
    element : str
        What the model lacks.
    outcome : ExamOutcome
        By the judge of the exam.
    held : bool or None
        Whether the interval of the coefficient holds the plant's; None where no such element was
        named at the same junction.
    off : float
        Coefficient over the plant's, less one.
    left : float
        What the repaired model leaves held out, over the noise, of the worst reading.
    """

    element: str
    outcome: ExamOutcome
    held: bool | None
    off: float
    left: float

    @property
    def line(self) -> str:
        """The answer in a line."""
        o = self.outcome
        found = "" if self.held is None else f"  coefficient off by {self.off:+.2%}"
        outside = "" if self.held is not False else ", outside its interval"
        left = f", repaired leaves {self.left:.3g}" if np.isfinite(self.left) else ""
        return (
            f"{o.id} {o.truth.plant:9s} no {self.element:5s} {o.outcome:11s} {o.answer.words}; "
            f"declared leaves {o.left:.3g} beside the noise{left}{found}{outside}, "
            f"{o.answer.seconds:.0f} s"
        )


def asked(layout: Layout, seed: int) -> list[Asked]:
    """Read the answers of a folder."""
    cases = {c.case.id: c for c in drawn(seed, len(elements_of(layout)))}
    rows = {r["id"]: r for r in json.loads(layout.truths.read_text(encoding="utf-8"))}
    files = sorted(layout.answers.glob("l*.json"))
    contents = (json.loads(f.read_text(encoding="utf-8")) for f in files)
    return [judged(cases[str(c["id"])], rows[str(c["id"])], c) for c in contents]


def judged(lacking: Lacking, row: Mapping[str, Any], content: Mapping[str, Any]) -> Asked:
    """Hold an answer against what is right.

    Parameters
    ----------
    row : mapping
        The truth as it was written with the recording: its noise and the plant's values.
    content : mapping
        Of the answer's file.
    """
    noise = {k: float(v) for k, v in row["noise_std"].items()}
    outcome = judge_exam(replace(truth_of(lacking), noise=noise), exam_answer_of(content))
    repaired = content.get("repaired_rms") or {}
    left = max((v / noise[k] for k, v in repaired.items()), default=np.nan)
    held, off = None, np.nan
    true = float(row["parameters"][lacking.element])
    for f in (content.get("verdict") or {}).get("findings", ()):
        own = f["answer"] in ("exact", "approximate") and f["effect"].startswith("linear_")
        if own and f["location"]["element"] in beside(model_of(lacking), lacking.element):
            (p,) = f["parameters"]
            # an end that is open is written as null
            ends = zip((-np.inf, np.inf), p["ci95"], strict=True)
            low, high = (free if v is None else v for free, v in ends)
            held, off = bool(low <= true <= high), p["value"] / true - 1.0
    return Asked(lacking.element, outcome, held, off, left)


def score_lines(found: Sequence[Asked]) -> list[str]:
    """Return the table."""
    outcomes = [a.outcome for a in found]
    named = [o for o in outcomes if any(c.claim.answer in ONE for c in o.claims)]
    words = Counter(o.outcome for o in outcomes)
    of_law = [a for a in found if not a.outcome.truth.outside]
    known = [a for a in found if a.held is not None]
    rates = {
        "one name was told": Rate(len(named), len(found)),
        "of these: a wrong one": Rate(
            sum(any(c.name is False and c.claim.answer in ONE for c in o.claims) for o in named),
            len(named),
        ),
        "of these: at a wrong place": Rate(
            sum(any(c.place is False for c in o.claims) for o in named), len(named)
        ),
        "elements that have a law and are missed in the readings": Rate(
            sum(not a.outcome.answer.reassuring for a in of_law), len(of_law)
        ),
        "named or among look-alikes where they are": Rate(
            sum(any(c.name for c in a.outcome.claims) for a in of_law
                if not a.outcome.answer.reassuring),
            sum(not a.outcome.answer.reassuring for a in of_law),
        ),
        "coefficient inside its 95 % interval": Rate(
            sum(a.held is True for a in known), len(known)
        ),
        "named alone, and repaired to 1.1 times the noise": Rate(
            sum(a.left <= LEFT_AT_NOISE for a in found if a.outcome in named), len(named)
        ),
        "nothing missing was said beside a misfit": Rate(
            sum(o.effect_explained or o.misfit_explained for o in outcomes), len(found)
        ),
        "crashes": Rate(sum(o.outcome == "crash" for o in outcomes), len(found)),
    }  # fmt: skip
    off = [abs(a.off) for a in known]
    seconds = [o.answer.seconds for o in outcomes]
    return [
        f"{'recordings':58s}{len(found)}",
        *(f"{name:58s}{rate}" for name, rate in rates.items()),
        f"{'coefficient off by, median':58s}{np.median(off) if off else np.nan:.2%}",
        f"{'seconds, median and longest':58s}{np.median(seconds):.0f}  {max(seconds):.0f}",
        "  ".join(f"{word} {n}" for word, n in words.most_common()),
    ]


ONE = ("exact", "approximate")
"""Answers that give one name."""
