"""The score in parts: what it says in words and tables, once for Markdown and for the page."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tests.proof.trial.commitment import changed_since
from tests.proof.trial.curves import HEADS, ahead_rows, at_equal_coverage, statement
from tests.proof.trial.gates import MISNAMED, Gate
from tests.proof.trial.scoring import TrialScore
from tests.proof.trial.tables import Confusion

Rows = Sequence[Sequence[str]]


@dataclass(frozen=True, slots=True)
class Part:
    """A headed piece of the score: words, a table, names of figures."""

    title: str
    text: str = ""
    heads: Sequence[str] = ()
    rows: Rows = ()
    figures: Sequence[str] = ()


def headline(score: TrialScore, withheld: Sequence[Gate] = ()) -> str:
    """Return how it went in a sentence or two.

    Parameters
    ----------
    withheld : sequence of Gate
        What the second proof has counted; nothing as long as it is open.
    """
    gates = (*score.gates, *withheld)
    missed = [g.name for g in gates if not g.passed]
    barely = [g.name for g in gates if g.passed and not g.certified]
    every = "All gates are met." if withheld else "All gates that were counted are met."
    said = [f"Not met: {'; '.join(missed)}." if missed else every]
    if barely:
        said.append(f"Met, not certified: {'; '.join(barely)}.")
    if (crashes := score.exam.rates["crashes"]).hits:
        said.append(f"{crashes.hits} of {crashes.total} crashed.")
    if not withheld:
        said.append(f"Open until bondsight blind withheld has counted it: {MISNAMED}.")
    return " ".join(said)


def facts(score: TrialScore, commitment: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what was run, and what was committed when."""
    hours = sum(o.answer.seconds for o in score.exam.outcomes if o.answer.seconds > 0) / 3600
    return [
        ("recordings", f"{len(score.exam.outcomes)}, {score.exam.rates['crashes'].hits} crashes"),
        ("process time", f"{hours:.2f} h"),
        *committed(commitment),
    ]


def committed(commitment: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what was committed when, and what is no longer so."""
    public = commitment.get("salt_public")
    return [
        ("kind", str(commitment.get("kind", "?"))),
        ("committed", f"{commitment.get('date', '?')} at {commitment.get('tool_commit', '?')}"),
        ("truths", str(commitment.get("truths_sha256", "?"))),
        *([("salt public before the end", str(public))] if public else []),
        ("changed since", " and ".join(changed_since(commitment)) or "nothing"),
    ]


def parts(score: TrialScore, withheld: Sequence[Gate] = ()) -> Iterator[Part]:
    """Return the score piece by piece; intervals are exact, 95 %."""
    yield gates_part((*score.gates, *withheld))
    rates = [(name, str(r), f"{100 * r.upper:.1f}") for name, r in score.exam.rates.items()]
    yield Part("Every rate", "", ("counted", "share", "upper bound, %"), rates)
    ends = sorted(score.exam.cells.items())
    yield Part(
        "How every cell ended", "", ("cell", "recordings", "ended"),
        [(c, str(n.total()), ", ".join(f"{k} {v}" for k, v in n.most_common())) for c, n in ends],
    )  # fmt: skip
    heads = ("concealed", "right", "answers")
    yield Part("Names", "", heads, list(_confused(score.names)), ("names",))
    places = [(plant, *row) for plant, c in score.places.items() for row in _confused(c)]
    yield Part("Places", "", ("plant", *heads), places)
    yield Part(
        "Power against strength",
        "Single effects by what they move the readings by, over their noise. By cell: green right "
        "place and name or kind, blue right name.",
        ("cell", "strength", "said to miss something", "right place, name or kind",
         "right name and place", "wrong name"),
        [
            (group, f"{p.low:g} to {p.high:g}", *map(str, (p.told, p.placed, p.named, p.wrong)))
            for group, powers in score.power.items() for p in powers
        ],
        ("power", "power_by_cell"),
    )  # fmt: skip
    logs = ", ".join(f"{k} {v:.4f}" for k, v in score.log_scores.items())
    yield Part(
        "Stated probability", f"Mean log score (0 is best): {logs}.", ("stated", "mean", "right"),
        [(f"{r.low:.2f} to {r.high:.2f}", f"{r.stated:.3f}", str(r.right))
         for r in score.exam.reliability],
        ("reliability",),
    )  # fmt: skip
    groups = {k: q for k, q in score.ratio_groups.items() if q}
    yield Part(
        "Held-out error after the repair over the oracle's",
        "The oracle is told effect and place. Without a repair the declared model counts."
        if groups else "No oracle was asked.",
        ("", *next(iter(groups.values()), {})),
        [(k, *(f"{v:.3f}" for v in q.values())) for k, q in groups.items()],
        ("error_over_oracle",),
    )  # fmt: skip
    if score.curves:
        found = at_equal_coverage(score.curves)
        yield Part(
            "Baselines on the same recordings", statement(found).capitalize() + ".", HEADS,
            ahead_rows(found), ("baselines",),
        )  # fmt: skip
    yield Part(
        "Time", "", ("", "s"),
        [(k, f"{v:.1f}") for k, v in score.exam.seconds.items() if math.isfinite(v)],
    )  # fmt: skip
    yield Part(
        "Everything that was wrong", "", ("recording", "cell", "plant", "wrong", "truth", "said"),
        [(o.id, o.truth.cell, o.truth.plant, ", ".join(o.wrong), o.truth.words, o.answer.words)
         for o in score.exam.outcomes if o.wrong],
    )  # fmt: skip


def gates_part(gates: Sequence[Gate]) -> Part:
    """Return the gates with their exact intervals and one-sided bounds."""
    return Part(
        "Gates",
        "Certified: were the true rate the limit, so good a count would come with a probability "
        "below 5 %. The bound is one-sided, 95 %: the upper one of errors, else the lower one.",
        ("", "gate", "count (95 % interval)", "bound, %", "asked"),
        [
            (g.state, g.name, str(g.counted), f"{100 * g.bound:.1f}", g.asked)
            for g in gates
        ],
    )  # fmt: skip


def _confused(c: Confusion) -> Iterator[tuple[str, str, str]]:
    for r in c.rows:
        said = sorted(c.counts[r].items(), key=lambda kv: (-kv[1], kv[0]))
        yield r, str(c.right[r]), ", ".join(f"{k} {v}" for k, v in said)
