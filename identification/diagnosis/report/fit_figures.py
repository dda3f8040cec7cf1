"""Figures of the fit: outputs, and residuals against the noise floor."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report.canvas import TILE, drawing, label, plain
from identification.diagnosis.report.numbers import axis_scale
from identification.diagnosis.report.style import BAND, FLOOR, MEASURED, MUTED
from identification.diagnosis.report.views import (
    Curve,
    bounds,
    curves,
    envelope,
    readable,
    residual,
    sampled,
    scored,
    unit_of,
)

Array = np.ndarray


def outputs_tile(d: Diagnosis, column: int) -> str:
    """Measured against simulated reading on a readable piece of the held-out samples."""
    data = d.data
    assert data is not None
    with drawing(f"outputs-{column}", 2.6, TILE) as canvas:
        ax = canvas.rows(1)[0, 0]
        _output(ax, d, curves(d), column, data.names[column])
        ax.set_xlabel("time (s)")
        _legend(canvas.figure, ax)
    return canvas.svg


def _output(ax: Any, d: Diagnosis, shown: tuple[Curve, ...], column: int, name: str) -> None:
    data = d.data
    assert data is not None
    piece = readable(data, column, residual(shown[0].fit, column) if shown else None)
    t, y = sampled(data.time[piece], data.readings[piece, column])
    factor, unit = axis_scale(unit_of(d, name), float(np.abs(y).max(initial=0.0)))
    ax.plot(t, factor * y, color=MEASURED, lw=2.6, alpha=0.35, label="measured")
    for k, curve in enumerate(shown):
        other = curve.fit.problem.data
        inside = (other.time >= t[0]) & (other.time <= t[-1])
        ts, ys = sampled(other.time[inside], curve.fit.simulated[inside, column])
        style = "--" if k == 0 and len(shown) > 1 else "-"
        ax.plot(
            ts, factor * ys, color=curve.colour, ls=style, label=plain(curve.label.split(":")[0])
        )
    ax.set_ylabel(label(name, unit))
    ax.set_xlim(t[0], t[-1])


def residual_tile(d: Diagnosis, column: int) -> str:
    """Residual over time with the noise floor."""
    data = d.data
    assert data is not None
    with drawing(f"residual-{column}", 2.6, TILE) as canvas:
        ax = canvas.rows(1)[0, 0]
        _residual(ax, d, curves(d), column, data.names[column])
        ax.set_xlabel("time (s)")
        _legend(canvas.figure, ax)
    return canvas.svg


def _residual(ax: Any, d: Diagnosis, shown: tuple[Curve, ...], column: int, name: str) -> None:
    data = d.data
    assert data is not None
    sigma = float(data.floor[column])
    sizes = [_largest(c, column) for c in shown]
    factor, unit = axis_scale(unit_of(d, name), max(sizes, default=sigma))
    for curve in shown:
        part = scored(curve.fit.problem.data)
        t, r = envelope(curve.fit.problem.data.time[part], residual(curve.fit, column)[part])
        ax.plot(t, factor * r, color=curve.colour, lw=0.7, label=plain(curve.label.split(":")[0]))
    ax.axhspan(
        -2 * factor * sigma, 2 * factor * sigma, color=BAND, lw=0, zorder=1,
        label="noise, ±2σ",
    )  # fmt: skip
    for side in (-2, 2):
        ax.axhline(side * factor * sigma, color=FLOOR, lw=0.8, ls="--", zorder=4)
    start, stop = bounds(data.split.test, data.n)
    held_out(ax, data.time, start, stop)
    ax.set_ylabel(label(f"{name}: residual", unit))
    _scored_axis(ax, d)


def _largest(curve: Curve, column: int) -> float:
    data = curve.fit.problem.data
    r = residual(curve.fit, column)[scored(data)]
    return float(np.nanmax(np.abs(r), initial=float(data.floor[column])))


def _scored_axis(ax: Any, d: Diagnosis) -> None:
    """Time axis over the samples that are scored: what was left out would set the scale."""
    assert d.data is not None
    t = d.data.time[scored(d.data)]
    ax.set_xlim(t[0], t[-1])


def held_out(ax: Any, time: Array, start: int, stop: int) -> None:
    """Mark the held-out samples along the top of a time plot."""
    if stop <= start:
        return
    a, b = float(time[start]), float(time[stop - 1])
    ax.axvspan(a, b, color="#0f6cbd", alpha=0.05, lw=0)
    ax.axvline(a, color=MUTED, lw=0.8, ls=":")
    ax.annotate(
        "held out", (a, 1.0), (2, 2), xycoords=ax.get_xaxis_transform(),
        textcoords="offset points", va="bottom", fontsize=7.5, color="#52606d",
    )  # fmt: skip


def thin_log(f: Array, a: Array, most: int = 300) -> tuple[Array, Array]:
    """Root mean square on even steps of the logarithm of the frequency."""
    if f.size <= most:
        return f, a
    edges = np.geomspace(f[0], f[-1] * 1.0001, most + 1)
    index = np.clip(np.searchsorted(edges, f, side="right") - 1, 0, most - 1)
    count = np.bincount(index, minlength=most)
    full = count > 0
    mean_f = np.bincount(index, f, most)[full] / count[full]
    mean_a = np.sqrt(np.bincount(index, a**2, most)[full] / count[full])
    return mean_f, mean_a


def recording_figure(d: Diagnosis) -> str:
    """All channels over time: what there is when nothing can be fitted."""
    names = list(d.recording.channels)[:8]
    with drawing("recording", 0.4 + 1.2 * len(names), 6.6) as canvas:
        axes = canvas.rows(len(names))[:, 0]
        for ax, name in zip(axes, names, strict=True):
            y = np.asarray(d.recording[name])
            factor, unit = axis_scale(unit_of(d, name), float(np.abs(y).max(initial=0.0)))
            t, v = envelope(np.asarray(d.recording.time), factor * y)
            ax.plot(t, v, color=MEASURED, lw=0.9)
            ax.set_ylabel(label(name, unit))
        axes[-1].set_xlabel("time (s)")
    return canvas.svg


def _legend(figure: Any, ax: Any) -> None:
    handles, texts = ax.get_legend_handles_labels()
    figure.legend(
        handles, texts, loc="outside upper left", ncols=len(texts), fontsize=8, handlelength=1.6,
        columnspacing=1.2,
    )  # fmt: skip
