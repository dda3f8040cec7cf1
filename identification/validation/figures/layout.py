"""What the figures share: which readings are shown, marks of the held-out samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.report.canvas import mark_held_out
from identification.report.traces import span
from identification.statistics.correlation import stretches
from identification.validation.judge import Judgement
from identification.validation.validation_data import ValidationRecord

MOST_ROWS = 6


def shown(j: Judgement) -> list[tuple[ValidationRecord, int]]:
    """Return the readings to draw; of many, those with the largest misfit over the floor."""
    every = [(r, c) for r in j.material.records for c in range(len(r.names))]
    size = [v.judged.chi2 for v in j.channels]
    ranked = sorted(range(len(every)), key=lambda i: -np.nan_to_num(size[i], nan=-1.0))
    return [every[i] for i in sorted(ranked[:MOST_ROWS])]


def left_out(j: Judgement) -> str:
    """Sentence on the readings that are not drawn; empty if all are."""
    count = len(j.channels) - MOST_ROWS
    return f" The {count} readings nearest to the floor are left out." if count > 0 else ""


def scored(record: ValidationRecord) -> slice:
    """Stretch of the record from the first to the last scored sample."""
    return span(record.train | record.test)


def tint_held_out(ax: Any, record: ValidationRecord) -> None:
    """Tint the held-out samples of a time plot."""
    for k, s in enumerate(stretches(record.test)[:20]):
        ends = float(record.time[s.start]), float(record.time[s.stop - 1])
        mark_held_out(ax, *ends, 0.06, named=k == 0)
