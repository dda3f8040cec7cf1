"""The table of an exam: one set of answers, or an old one beside it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from hardware.simulators.judging.outcome import ExamOutcome
from tests.proof.exam.cells import CELLS
from tests.proof.exam.counting import ExamScore
from tests.proof.trial.rates import Rate

_WIDE = 76


def table_lines(new: ExamScore, old: ExamScore | None = None) -> list[str]:
    """Return the lines of the table; with `old` its numbers stand in the first column."""
    scores = [s for s in (old, new) if s is not None]
    heads = ("old", "new") if old is not None else ("",)
    lines = [_line("recordings", [str(len(s.outcomes)) for s in scores], heads)]
    if old is not None:
        lines.insert(0, _line("", heads, heads))
    for name in {**new.rates, **(old.rates if old else {})}:
        lines.append(_line(name, [str(s.rates.get(name, Rate(0, 0))) for s in scores], heads))
    for name in new.seconds:
        lines.append(_line(name, [f"{s.seconds[name]:.1f}" for s in scores], heads))
    for cell in CELLS:
        for word, s in zip(heads, scores, strict=True):
            if cell in s.cells:
                lines.append(f"{cell:13s} {word:4s} {_counts(s.cells[cell])}".rstrip())
    for word, s in zip(heads, scores, strict=True):
        for r in s.reliability:
            lines.append(
                f"stated {r.low:.2f} to {r.high:.2f} {word:4s} mean {r.stated:.3f}  right {r.right}"
            )
    return lines


def _line(name: str, values: Sequence[str], heads: Sequence[str]) -> str:
    return (f"{name:{_WIDE}s}" + "".join(f"{v:34s}" for v in values)).rstrip()


def _counts(found: Counter[str]) -> str:
    return "  ".join(f"{word} {n}" for word, n in found.most_common())


def bad_lines(outcomes: Sequence[ExamOutcome]) -> list[str]:
    """Return a line for every recording of which something wrong was said."""
    return [
        f"{o.id}  {o.truth.cell:12s} {o.truth.plant:8s} {', '.join(o.wrong)}\n"
        f"       truth {o.truth.words}; left {o.left:.3g} times the noise\n"
        f"       said  {o.answer.verdict}: {o.answer.words}"
        for o in outcomes
        if o.wrong
    ]
