"""The score in words: RESULTS.md."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from identification.report.tables import markdown
from tests.proof.trial.gates import Gate
from tests.proof.trial.scoring import Score
from tests.proof.trial.tables import Confusion


def summary(score: Score, commitment: Mapping[str, Any], title: str = "Sealed trial") -> str:
    """Return the whole score as Markdown; intervals are Wilson's, 95 %."""
    parts = [
        f"# {title}",
        _head(score, commitment),
        "## Gates",
        gates_table(score.gates),
        "Recordings with one effect: "
        + ", ".join(f"{n} {words}" for words, n in score.asked.items())
        + ". An effect is distinguishable if the nominal misfit exceeds what the true law leaves "
        "by more than 3 dB and the fit of the true law beats every rival that does not contain it "
        "by more than 3 standard errors.",
        "A place counts as right if the true element is the one stated or among those that the "
        "finding calls indistinguishable from it; a place that names more than half of the model's "
        "ports counts as not given. Names given are exact names, families and sets of look-alikes; "
        "one that excludes the truth is wrong. Rates among distinguishable effects ask for the "
        "exact name.",
        "## How every kind of recording ended",
        _cells(score),
        "## Names",
        _confusion(score.names, "concealed"),
        "![names](names.svg)",
        "## Places",
        *(f"### {plant}\n\n{_confusion(c, 'concealed at')}" for plant, c in score.places.items()),
        "## Power against strength",
        _power(score),
        "![power](power.svg)",
        "## Stated confidence",
        _calibration(score),
        "![calibration](calibration.svg)",
        "## Look-alike pairs",
        _pairs(score),
        "## Baselines on the same recordings",
        _baselines(score),
        "Every recording is listed in `trials.csv`, all numbers stand in `score.json`.",
    ]
    return "\n\n".join(p for p in parts if p) + "\n"


def _head(score: Score, commitment: Mapping[str, Any]) -> str:
    crashed = sum(bool(o.answer.error) for o in score.outcomes)
    seconds = sum(o.answer.seconds for o in score.outcomes)
    slowest = max((o.answer.seconds for o in score.outcomes), default=0.0)
    return (
        f"{len(score.outcomes)} recordings, {crashed} crashes; committed "
        f"{commitment.get('date', '?')} at commit `{commitment.get('tool_commit', '?')}`, truths "
        f"`{commitment.get('truths_sha256', '?')}`. Diagnosis took {seconds / 3600:.2f} h of "
        f"process time, the slowest {slowest:.0f} s. "
        + ("All gates are met." if score.passed else "**Not all gates are met.**")
    )


def gates_table(gates: Sequence[Gate]) -> str:
    """Return the gates as a Markdown table."""
    body = []
    for g in gates:
        value = f"{g.value:.3f}" if g.counted is None else str(g.counted)
        limit = f"{100 * g.limit:.0f} %" if g.counted is not None else f"{g.limit:.2f}"
        said = {True: "met", False: "**failed**", None: "nothing to count"}[g.passed]
        body.append(
            (
                g.name,
                value if g.passed is not None else "-",
                f"{'<=' if g.most else '>='} {limit}" if g.gated else "printed only",
                said if g.gated else "",
            )
        )
    return markdown(("gate", "value (95 % interval)", "limit", ""), body)


def gate_lines(gates: Sequence[Gate]) -> str:
    """Return the gates as lines for a terminal."""
    words = {True: "met   ", False: "FAILED", None: "empty "}
    lines = []
    for g in gates:
        value = f"{g.value:.3f}" if g.counted is None else str(g.counted)
        limit = f"{'<=' if g.most else '>='} {g.limit:g}" if g.gated else ""
        lines.append(f"{words[g.passed] if g.gated else '      '} {g.name}: {value} {limit}")
    return "\n".join(line.rstrip() for line in lines)


def _cells(score: Score) -> str:
    body = [
        (cell, str(sum(ends.values())), ", ".join(f"{k} {v}" for k, v in ends.most_common()))
        for cell, ends in score.cells.items()
    ]
    return markdown(("kind", "recordings", "ended"), body)


def _confusion(c: Confusion, what: str) -> str:
    body = []
    for r in c.rows:
        said = sorted(c.counts[r].items(), key=lambda kv: (-kv[1], kv[0]))
        body.append((r, str(c.right[r]), ", ".join(f"{k} {v}" for k, v in said)))
    return markdown((what, "right", "answers"), body) if body else "Nothing to count."


def _power(score: Score) -> str:
    body = [
        (f"{p.low:.0f} to {p.high:.0f}", str(p.detected), str(p.named), str(p.wrong))
        for p in score.power
    ]
    head = ("excess over the floor, dB", "detected", "right name and place", "wrong name")
    return markdown(head, body) if body else "Nothing to count."


def _calibration(score: Score) -> str:
    c = score.calibration
    if not c.names:
        return "No exact name was given."
    body = [(f"{r.low:.2f} to {r.high:.2f}", f"{r.stated:.3f}", str(r.right)) for r in c.table]
    return f"{c.names} names, Brier score {c.brier:.4f}.\n\n" + markdown(
        ("stated", "mean stated", "right"), body
    )


def _pairs(score: Score) -> str:
    body = [
        (
            p.name,
            "decisive" if p.decisive else "indecisive",
            ", ".join(f"{k} {v}" for k, v in sorted(p.outcomes.items())),
        )
        for p in score.pairs
    ]
    return markdown(("pair", "excitation", "ended"), body) if body else "There are none."


def _baselines(score: Score) -> str:
    body = [
        (
            b.name,
            str(b.answered),
            str(b.alarms),
            str(b.outside),
            str(b.wrong),
            str(b.misplaced),
            str(b.right),
        )
        for b in score.baselines
    ]
    head = ("rule", "answers", "false alarms", "outside named", "wrong names", "wrong places",
            "right among the distinguishable")  # fmt: skip
    text = markdown(head, body)
    if score.black_box:
        box = statistics.median(a for a, _ in score.black_box)
        tool = [b for _, b in score.black_box if b == b]
        text += (
            f"\n\nA black box on the residual (ridge regression on lagged commands and simulated "
            f"readings, their squares and cubes) names nothing; its held-out error is {box:.2f} "
            f"times the oracle's (median over {len(score.black_box)} distinguishable effects"
        )
        text += f"; the repaired model's {statistics.median(tool):.2f})." if tool else ")."
    return text + (
        "\n\nThe first two rules choose among the effects that the diagnosis fitted: where it saw "
        "nothing to explain it fitted none, and they say nothing either. "
        "The sparse regression gets all states: they are made from all sensors by smoothing "
        "and by integration, so it answers only where every sensor was recorded."
    )
