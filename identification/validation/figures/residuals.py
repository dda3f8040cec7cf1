"""Residuals over time and over frequency, each with the noise floor."""

from __future__ import annotations

from typing import Any

import numpy as np

from bondgraph.support.arrays import Array
from identification.report.canvas import drawing, label, noise_band, one_legend, plain
from identification.report.numbers import axis_scale
from identification.report.picture import Picture
from identification.report.style import AFTER, BEFORE, FLOOR
from identification.report.traces import envelope, thin_log
from identification.statistics.correlation import stretches
from identification.validation.figures.layout import left_out, scored, shown, tint_held_out
from identification.validation.judge import Judgement
from identification.validation.validation_data import ValidationRecord


def residual_figure(j: Judgement) -> Picture:
    """Draw residuals over time, and their spectrum beside that of the reading and the floor."""
    rows = shown(j)
    held = any(r.test.any() for r, _ in rows)
    with drawing("residuals", 0.6 + 2.2 * len(rows)) as canvas:
        axes = canvas.rows(len(rows), (1.4, 1))
        for (time, spectrum), (record, c) in zip(axes, rows, strict=True):
            _over_time(time, record, c, j.material.label(record.names[c], record.name))
            _spectrum(spectrum, record, c)
        axes[-1, 0].set_xlabel("time (s)")
        axes[-1, 1].set_xlabel("frequency (Hz)")
        one_legend(canvas.figure, [axes[0, 0], axes[0, 1]])
    part = "held-out" if held else "training"
    return Picture(
        canvas.svg,
        f"Residuals over time (±2σ of the floor tinted), and the amplitude density of the {part} "
        f"residual beside that of the reading; white noise of the floor's level is dashed."
        f"{left_out(j)}",
    )


def _over_time(ax: Any, record: ValidationRecord, c: int, name: str) -> None:
    part = scored(record)
    r, sigma = record.residual[part, c], float(record.floor[c])
    size = float(np.nanmax(np.abs(r), initial=2.5 * sigma))
    factor, unit = axis_scale(record.units[c], size)
    edge = 2 * factor * sigma
    t, v = envelope(record.time[part], factor * r)
    ax.plot(t, v, color=AFTER, lw=0.6, label="residual", zorder=2)
    noise_band(ax, edge, "noise floor, ±2σ", 0.9)
    tint_held_out(ax, record)
    ax.set_ylabel(label(f"{name}: residual", unit))
    ax.set_xlim(record.time[part][0], record.time[part][-1])


def _spectrum(ax: Any, record: ValidationRecord, c: int) -> None:
    mask = record.part("test" if record.test.any() else "train")
    f, a = density(record.residual[:, c], mask, record.dt)
    _, b = density(record.measured[:, c], mask, record.dt)
    level = float(record.floor[c]) * np.sqrt(2 * record.dt)
    if f.size:
        factor, unit = axis_scale(record.units[c], max(level, float(a.max())))
        ax.loglog(f, factor * b, color=BEFORE, lw=0.8, alpha=0.6, label="reading")
        ax.loglog(f, factor * a, color=AFTER, lw=0.9)
    else:
        factor, unit = axis_scale(record.units[c], level)
        ax.set(xscale="log", yscale="log")
    ax.axhline(factor * level, color=FLOOR, lw=1.4, ls="--", label="white noise at the floor")
    ax.set_ylabel(plain(f"density ({unit or 1}/√Hz)"))


def density(values: Array, mask: Array, dt: float) -> tuple[Array, Array]:
    """Frequencies and amplitude density of the longest scored stretch, thinned on a log axis."""
    from scipy.signal import welch

    good = mask & np.isfinite(values)
    longest = max(stretches(good), key=lambda s: s.stop - s.start, default=slice(0, 0))
    v = values[longest]
    if v.size < 16:
        return np.zeros(0), np.zeros(0)
    f, p = welch(v, fs=1 / dt, nperseg=min(v.size, max(1024, v.size // 4)), detrend="constant")
    return thin_log(f[1:], np.sqrt(p[1:]))
