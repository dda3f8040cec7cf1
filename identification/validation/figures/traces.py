"""Measured and simulated readings with the noise floor around the simulation."""

from __future__ import annotations

from typing import Any

import numpy as np

from bondgraph.support.arrays import Array
from identification.report.canvas import drawing, label, one_legend
from identification.report.numbers import axis_scale
from identification.report.picture import Picture
from identification.report.style import AFTER, BAND, FLOOR, MEASURED
from identification.report.traces import envelope, worst_stretch
from identification.statistics.correlation import stretches
from identification.validation.figures.layout import left_out, scored, shown, tint_held_out
from identification.validation.judge import Judgement
from identification.validation.validation_data import ValidationRecord


def trace_figure(j: Judgement) -> Picture:
    """Draw the whole record, and the piece of the held-out samples that fits worst."""
    rows = shown(j)
    with drawing("traces", 0.6 + 2.1 * len(rows)) as canvas:
        axes = canvas.rows(len(rows), (1, 1.25))
        for (whole, near), (record, c) in zip(axes, rows, strict=True):
            name = j.material.label(record.names[c], record.name)
            _whole(whole, record, c, name)
            _near(near, record, c, name)
        for ax in axes[-1]:
            ax.set_xlabel("time (s)")
        one_legend(canvas.figure, [axes[0, 1], axes[0, 0]])
    return Picture(
        canvas.svg,
        "Left: the record. Right: about six oscillations where the residual is largest, with the "
        f"noise floor (two standard deviations) around the simulation.{left_out(j)}",
    )


def _scale(record: ValidationRecord, c: int) -> tuple[float, str]:
    y = record.measured[scored(record), c]
    size = float(np.nanmax(np.abs(y), initial=float(record.floor[c])))
    return axis_scale(record.units[c], size)


def _whole(ax: Any, record: ValidationRecord, c: int, name: str) -> None:
    factor, unit = _scale(record, c)
    part = scored(record)
    t = record.time[part]
    ax.plot(*_thin(t, factor * record.measured[part, c]), color=MEASURED, lw=1.6, alpha=0.35)
    ax.plot(*_thin(t, factor * record.simulated[part, c]), color=AFTER, lw=0.7)
    tint_held_out(ax, record)
    ax.set_ylabel(label(name, unit))
    ax.set_xlim(t[0], t[-1])


def _thin(t: Array, v: Array) -> tuple[Array, Array]:
    return envelope(t, v, 900)


def _near(ax: Any, record: ValidationRecord, c: int, name: str) -> None:
    factor, unit = _scale(record, c)
    piece = worst_piece(record, c)
    t, y = record.time[piece], factor * record.measured[piece, c]
    s, sigma = factor * record.simulated[piece, c], factor * float(record.floor[c])
    step = max(1, -(-t.size // 900))
    ax.fill_between(
        t[::step], (s - 2 * sigma)[::step], (s + 2 * sigma)[::step], color=BAND, lw=0.6,
        ec=FLOOR, label="noise floor, ±2σ",
    )  # fmt: skip
    ax.plot(*_thin(t, y), color=MEASURED, lw=2.4, alpha=0.35, label="measured")
    ax.plot(*_thin(t, s), color=AFTER, lw=1.0, label="simulated")
    ax.set_ylabel(label(name, unit))
    if t[-1] > t[0]:
        ax.set_xlim(t[0], t[-1])


def worst_piece(record: ValidationRecord, c: int) -> slice:
    """About six oscillations of the held-out samples (else of training) with most residual."""
    mask = record.part("test" if record.test.any() else "train")
    longest = max(stretches(mask), key=lambda s: s.stop - s.start, default=scored(record))
    start, stop = longest.start, longest.stop
    y = np.nan_to_num(record.measured[start:stop, c])
    found = worst_stretch(y, record.residual[start:stop, c], 200)
    return slice(start + found.start, start + found.stop)
