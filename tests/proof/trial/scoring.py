"""The score of a trial: every number that is published, as one frozen value."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bondgraph.support.errors import UnusableInput
from hardware.simulators.judging.claims import ExamAnswer
from hardware.simulators.judging.outcome import ExamOutcome
from hardware.simulators.judging.truths import ExamTruth
from tests.proof.exam.counting import ExamScore, score_exam, stated
from tests.proof.trial.calibration import log_score, plain_log_score
from tests.proof.trial.curves import Curve
from tests.proof.trial.gates import Gate, gates
from tests.proof.trial.oracles import Reached, oracle_ratio, quantiles, repair_ratio
from tests.proof.trial.rates import Rate
from tests.proof.trial.tables import Confusion, Power, name_confusion, place_confusion, power


@dataclass(frozen=True, eq=False)
class TrialScore:
    """Everything that was counted.

    Attributes
    ----------
    exam : ExamScore
        Outcomes and rates by the one judge of exam and trial.
    log_scores : mapping
        Of the stated probabilities, and of who states their overall frequency.
    ratios : mapping
        Held-out error after the repair over the oracle's, by recording.
    yardsticks : mapping
        Held-out error of the oracle over the noise, by recording.
    curves : tuple of Curve
        The tool's, then those of the baselines.
    """

    exam: ExamScore
    gates: tuple[Gate, ...]
    names: Confusion
    places: Mapping[str, Confusion]
    power: Mapping[str, tuple[Power, ...]]
    log_scores: Mapping[str, float]
    ratios: Mapping[str, float]
    yardsticks: Mapping[str, float]
    curves: tuple[Curve, ...]

    @property
    def passed(self) -> bool:
        """Every gate that is counted here is met; where there was nothing to count, it is not."""
        return all(g.passed for g in self.gates)

    @property
    def ratio_groups(self) -> dict[str, dict[str, float]]:
        """Quantiles of the ratios, of all and where the effect was named rightly."""
        named = [o.id for o in self.exam.outcomes if o.truth.main in o.found]
        return {
            "all single effects": quantiles([*self.ratios.values()]),
            "named rightly": quantiles([self.ratios[i] for i in named if i in self.ratios]),
            "the oracle's error over the noise": quantiles([*self.yardsticks.values()]),
        }


def score_trial(
    truths: Mapping[str, ExamTruth],
    answers: Mapping[str, ExamAnswer],
    oracles: Mapping[str, Reached] | None = None,
    curves: tuple[Curve, ...] = (),
) -> TrialScore:
    """Score a trial.

    Raises
    ------
    UnusableInput
        A recording has no answer: every one counts.
    """
    missing = sorted(truths.keys() - answers.keys())
    if missing:
        raise UnusableInput(f"{len(missing)} recordings have no answer, first {missing[0]}")
    exam, oracles = score_exam(truths, answers), oracles or {}
    given = stated(exam.outcomes)
    told = [(o, oracles[o.id]) for o in exam.outcomes if o.id in oracles]
    return TrialScore(
        exam,
        gates(exam.rates),
        name_confusion(exam.outcomes),
        place_confusion(exam.outcomes),
        power(exam.outcomes),
        {"stated": log_score(given), "the same for all": plain_log_score(given)},
        {o.id: r for o, best in told if math.isfinite(r := repair_ratio(o, best))},
        {o.id: r for o, best in told if math.isfinite(r := oracle_ratio(o, best))},
        curves,
    )


def plain(s: TrialScore, withheld: Sequence[Gate] = ()) -> dict[str, Any]:
    """Return the score as JSON data.

    Parameters
    ----------
    withheld : sequence of Gate
        What the second proof has counted; as long as it is open the trial has not passed.
    """
    return {
        "schema": "bondsight.blind/2",
        "recordings": len(s.exam.outcomes),
        "passed": s.passed and bool(withheld) and all(g.passed for g in withheld),
        "gates": [gate_row(g) for g in s.gates],
        "withheld": [gate_row(g) for g in withheld],
        "rates": {name: rate_row(r) for name, r in s.exam.rates.items()},
        "cells": {cell: dict(c) for cell, c in sorted(s.exam.cells.items())},
        "names": _confusion_row(s.names),
        "places": {plant: _confusion_row(c) for plant, c in s.places.items()},
        "power": {
            group: [
                {"from": p.low, "to": _number(p.high)}
                | {n: rate_row(getattr(p, n)) for n in ("told", "placed", "named", "wrong")}
                for p in powers
            ]
            for group, powers in s.power.items()
        },
        "reliability": [
            {"low": r.low, "high": r.high, "stated": r.stated, "right": rate_row(r.right)}
            for r in s.exam.reliability
        ],
        "log_scores": {k: _number(v) for k, v in s.log_scores.items()},
        "error_over_oracle": s.ratio_groups,
        "baselines": {c.name: [[*map(_number, p)] for p in c.points] for c in s.curves},
        "seconds": {k: _number(v) for k, v in s.exam.seconds.items()},
        "each": [
            _row(o)
            | {
                "error_over_oracle": s.ratios.get(o.id),
                "oracle_over_noise": s.yardsticks.get(o.id),
            }
            for o in s.exam.outcomes
        ],
    }


def gate_row(g: Gate) -> dict[str, Any]:
    """Return a gate as JSON data."""
    return {
        "name": g.name,
        "limit": g.limit,
        "sense": "at most" if g.most else "at least",
        "counted": rate_row(g.counted),
        "bound95": g.bound,
        "p": g.p,
        "state": g.state,
    }


def gate_of(row: Mapping[str, Any]) -> Gate:
    """Return a gate that was written by `gate_row`."""
    counted = Rate(int(row["counted"]["hits"]), int(row["counted"]["total"]))
    return Gate(str(row["name"]), counted, float(row["limit"]), row["sense"] == "at most")


def rate_row(r: Rate) -> dict[str, Any]:
    """Return a rate as JSON data."""
    return {
        "hits": r.hits,
        "total": r.total,
        "value": _number(r.value),
        "ci95": list(r.exact),
    }


def _confusion_row(c: Confusion) -> dict[str, Any]:
    return {
        "rows": list(c.rows),
        "columns": list(c.columns),
        "counts": {r: dict(v) for r, v in c.counts.items()},
        "right": {r: rate_row(v) for r, v in c.right.items()},
    }


def _row(o: ExamOutcome) -> dict[str, Any]:
    """Every recording is reported."""
    return {
        "id": o.id,
        "cell": o.truth.cell,
        "plant": o.truth.plant,
        "truth": o.truth.words,
        "verdict": o.answer.verdict or "crash",
        "said": o.answer.words,
        "outcome": o.outcome,
        "wrong": list(o.wrong),
        "left_over_noise": _number(o.left),
        "seconds": _number(o.answer.seconds),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
