"""The score of a trial: every number that is published, as one frozen value."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from tests.proof.trial.answers import Answer
from tests.proof.trial.baselines import Baseline, baselines
from tests.proof.trial.calibration import Calibration, calibration
from tests.proof.trial.gates import Gate, asked_for, gates, sorted_out
from tests.proof.trial.matching import Outcome, judge
from tests.proof.trial.oracles import OracleAnswer, repair_ratio
from tests.proof.trial.rates import Rate
from tests.proof.trial.tables import (
    Confusion,
    Pair,
    Power,
    cells,
    name_confusion,
    pairs,
    place_confusion,
    power,
)
from tests.proof.trial.truths import Truth


@dataclass(frozen=True, eq=False)
class Score:
    """Everything that was counted.

    Attributes
    ----------
    outcomes : tuple of Outcome
        Every recording, in the order of the ids.
    asked : mapping
        Recordings with one effect by what the oracle says of them.
    black_box : tuple of (float, float)
        For every distinguishable effect: held-out error of a black box on the residual and of the
        tool's repair, both over the oracle's.
    """

    outcomes: tuple[Outcome, ...]
    oracles: Mapping[str, OracleAnswer]
    gates: tuple[Gate, ...]
    asked: Mapping[str, int]
    cells: Mapping[str, Counter[str]]
    names: Confusion
    places: Mapping[str, Confusion]
    power: tuple[Power, ...]
    calibration: Calibration
    pairs: tuple[Pair, ...]
    baselines: tuple[Baseline, ...]
    black_box: tuple[tuple[float, float], ...]

    @property
    def passed(self) -> bool:
        """Every gate is met; where there was nothing to count, it is not."""
        return all(g.passed for g in self.gates if g.gated)


def score(
    truths: Mapping[str, Truth],
    answers: Mapping[str, Answer],
    oracles: Mapping[str, OracleAnswer] | None = None,
) -> Score:
    """Score answers against truths; a recording without an answer counts as a crash."""
    oracles = oracles or {}
    outcomes = tuple(
        judge(
            truths[i],
            answers.get(i, Answer(i, "", (), 0.0, "no answer")),
            oracles[i].separable if i in oracles and math.isfinite(oracles[i].z) else None,
        )
        for i in sorted(truths)
    )
    return Score(
        outcomes,
        oracles,
        gates(outcomes, oracles),
        sorted_out(outcomes, oracles),
        cells(outcomes),
        name_confusion(outcomes),
        place_confusion(outcomes),
        power(outcomes, oracles),
        calibration(outcomes),
        pairs(outcomes),
        baselines(outcomes, oracles),
        _black_box(outcomes, oracles),
    )


def _black_box(
    outcomes: Sequence[Outcome], oracles: Mapping[str, OracleAnswer]
) -> tuple[tuple[float, float], ...]:
    found = []
    for o in asked_for(outcomes, oracles, separable=True):
        oracle = oracles[o.truth.id]
        if math.isfinite(o.answer.black_box) and oracle.chi2 > 0:
            found.append(
                (math.sqrt(o.answer.black_box / oracle.chi2), repair_ratio(o.answer, oracle))
            )
    return tuple(found)


def rows(score: Score) -> list[dict[str, Any]]:
    """Return one row a recording: every trial is reported."""
    found = []
    for o in score.outcomes:
        oracle = score.oracles.get(o.truth.id)
        found.append(
            {
                "id": o.truth.id,
                "cell": o.truth.cell,
                "plant": o.truth.plant,
                "effects": " + ".join(e.effect for e in o.truth.effects),
                "laws": " + ".join(e.law for e in o.truth.effects),
                "elements": " + ".join(e.element for e in o.truth.effects),
                "control": o.truth.control,
                "pair": o.truth.pair,
                "decisive": o.truth.decisive if o.truth.pair else "",
                "strength_db": _shown(o.truth.strength),
                "verdict": o.answer.verdict or "crash",
                "named": o.named,
                "placed": o.placed,
                "name": o.name,
                "place": o.place,
                "found": o.found,
                "confidence": _shown(
                    max((j.statement.confidence for j in o.judged), default=float("nan"))
                ),
                "excess_db": _shown(oracle.excess if oracle else float("nan")),
                "oracle_z": _shown(oracle.z if oracle else float("nan")),
                "repair_over_oracle": _shown(
                    repair_ratio(o.answer, oracle) if oracle else float("nan")
                ),
                "seconds": _shown(o.answer.seconds),
                "error": o.answer.error.strip().splitlines()[-1] if o.answer.error else "",
            }
        )
    return found


def _shown(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else ""


def plain(score: Score) -> dict[str, Any]:
    """Return the score as JSON data, without the recordings."""
    return {
        "schema": "bondsight.blind/1",
        "recordings": len(score.outcomes),
        "passed": score.passed,
        "gates": [
            {
                "name": g.name,
                "value": _number(g.value),
                "limit": g.limit,
                "sense": "at most" if g.most else "at least",
                "passed": g.passed,
                "gated": g.gated,
                "counted": rate_row(g.counted),
            }
            for g in score.gates
        ],
        "oracle": dict(score.asked),
        "cells": {k: dict(v) for k, v in score.cells.items()},
        "names": confusion_row(score.names),
        "places": {k: confusion_row(v) for k, v in score.places.items()},
        "power": [
            {
                "from_db": p.low,
                "to_db": p.high,
                "detected": rate_row(p.detected),
                "right": rate_row(p.named),
                "wrong_name": rate_row(p.wrong),
            }
            for p in score.power
        ],
        "calibration": {
            "brier": _number(score.calibration.brier),
            "names": score.calibration.names,
            "table": [
                {"low": r.low, "high": r.high, "stated": r.stated, "right": rate_row(r.right)}
                for r in score.calibration.table
            ],
        },
        "pairs": [asdict(p) | {"outcomes": dict(p.outcomes)} for p in score.pairs],
        "baselines": [
            {
                "name": b.name,
                "answered": b.answered,
                **{
                    n: rate_row(getattr(b, n))
                    for n in ("alarms", "outside", "wrong", "misplaced", "right")
                },
            }
            for b in score.baselines
        ],
        "black_box": [[_number(a), _number(b)] for a, b in score.black_box],
    }


def rate_row(r: Rate | None) -> dict[str, Any] | None:
    """Return a rate as JSON data."""
    if r is None:
        return None
    return {
        "hits": r.hits,
        "total": r.total,
        "value": _number(r.value),
        "ci95": list(r.interval),
    }


def confusion_row(c: Confusion) -> dict[str, Any]:
    """Return a confusion matrix as JSON data."""
    return {
        "rows": list(c.rows),
        "columns": list(c.columns),
        "counts": {r: dict(v) for r, v in c.counts.items()},
        "right": {r: rate_row(v) for r, v in c.right.items()},
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
