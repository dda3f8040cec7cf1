"""Whether the stated confidence is the frequency of being right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from tests.proof.trial.matching import Outcome
from tests.proof.trial.rates import Rate, rate

EDGES = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0)


@dataclass(frozen=True, slots=True)
class Reliability:
    """Answers whose confidence lies in one range."""

    low: float
    high: float
    stated: float
    right: Rate


@dataclass(frozen=True, slots=True)
class Calibration:
    """Confidence against frequency.

    Attributes
    ----------
    brier : float
        Mean square of confidence less outcome; nan without names.
    names : int
        Exact names given, all cells and controls.
    """

    brier: float
    names: int
    table: tuple[Reliability, ...]


def calibration(outcomes: Sequence[Outcome]) -> Calibration:
    """Compare the confidence of every exact name with whether name and place were right."""
    points = [
        (j.statement.confidence, j.name == "right" and j.place != "wrong")
        for o in outcomes
        for j in o.judged
        if j.statement.answer == "exact"
    ]
    if not points:
        return Calibration(float("nan"), 0, ())
    brier = sum((c - ok) ** 2 for c, ok in points) / len(points)
    return Calibration(brier, len(points), reliability(points, EDGES))


def reliability(
    points: Sequence[tuple[float, bool]], edges: Sequence[float]
) -> tuple[Reliability, ...]:
    """Return what was stated beside how often it was right, between every two edges."""
    table = []
    for low, high in pairwise(edges):
        inside = [(c, ok) for c, ok in points if low <= c < high or (high == 1.0 and c >= 1.0)]
        if inside:
            stated = sum(c for c, _ in inside) / len(inside)
            table.append(Reliability(low, high, stated, rate(ok for _, ok in inside)))
    return tuple(table)
