"""What the figures share: which readings are shown, legends, marks of the held-out samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from identification.diagnosis.report.style import MUTED
from identification.validation.judge import Judgement
from identification.validation.stretches import stretches
from identification.validation.validation_data import ValidationRecord

Array = np.ndarray
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


def title_of(j: Judgement, record: ValidationRecord, column: int) -> str:
    """Name of a reading, with its record where there are several."""
    name = record.names[column]
    return f"{name} of {record.name}" if len(j.material.records) > 1 else name


def scored(record: ValidationRecord) -> slice:
    """Stretch of the record from the first to the last scored sample."""
    index = np.flatnonzero(record.train | record.test)
    return slice(int(index[0]), int(index[-1]) + 1) if index.size else slice(0, record.time.size)


def mark_held_out(ax: Any, record: ValidationRecord) -> None:
    """Tint the held-out samples of a time plot."""
    for k, s in enumerate(stretches(record.test)[:20]):
        a, b = float(record.time[s.start]), float(record.time[s.stop - 1])
        ax.axvspan(a, b, color="#0f6cbd", alpha=0.06, lw=0)
        ax.axvline(a, color=MUTED, lw=0.8, ls=":")
        if k == 0:
            ax.annotate(
                "held out", (a, 1.0), (2, 2), xycoords=ax.get_xaxis_transform(),
                textcoords="offset points", va="bottom", fontsize=7.5, color="#52606d",
            )  # fmt: skip


def legend(figure: Any, axes: Sequence[Any]) -> None:
    """One legend above the figure for everything labelled in some axes."""
    found: dict[str, Any] = {}
    for ax in axes:
        for handle, text in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(text, handle)
    if found:
        figure.legend(
            list(found.values()), list(found), loc="outside upper left", ncols=min(len(found), 5)
        )
