"""Figures of the fit: outputs, and residuals against the noise floor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bondgraph.signals.split import stretches
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report.views import (
    Curve,
    curves,
    readable,
    residual,
    scored,
    unit_of,
)
from identification.report.canvas import (
    TILE,
    drawing,
    label,
    mark_held_out,
    noise_band,
    one_legend,
)
from identification.report.numbers import axis_scale
from identification.report.style import MEASURED
from identification.report.traces import envelope, sampled
from identification.study.problem import Data


def outputs_tile(d: Diagnosis, column: int) -> str:
    """Measured against simulated reading on a readable piece of the held-out samples."""
    return _tile("outputs", _output, d, column)


def _output(ax: Any, d: Diagnosis, data: Data, shown: tuple[Curve, ...], column: int) -> None:
    name = data.names[column]
    piece = readable(data, column, residual(shown[0].fit, column) if shown else None)
    t, y = sampled(data.time[piece], data.readings[piece, column])
    factor, unit = axis_scale(unit_of(d, name), float(np.abs(y).max(initial=0.0)))
    ax.plot(t, factor * y, color=MEASURED, lw=2.6, alpha=0.35, label="measured")
    for k, curve in enumerate(shown):
        other = curve.fit.problem.data
        inside = (other.time >= t[0]) & (other.time <= t[-1])
        ts, ys = sampled(other.time[inside], curve.fit.simulated[inside, column])
        style = "--" if k == 0 and len(shown) > 1 else "-"
        ax.plot(ts, factor * ys, color=curve.colour, ls=style, label=curve.label)
    ax.set_ylabel(label(name, unit))
    ax.set_xlim(t[0], t[-1])


def residual_tile(d: Diagnosis, column: int) -> str:
    """Residual over time with the noise floor."""
    return _tile("residual", _residual, d, column)


def _tile(name: str, draw: Callable[..., None], d: Diagnosis, column: int) -> str:
    with drawing(f"{name}-{column}", 2.6, TILE) as canvas:
        draw(canvas.ax, d, d.data, curves(d), column)
        canvas.ax.set_xlabel("time (s)")
        one_legend(canvas.figure, [canvas.ax], fontsize=8, handlelength=1.6, columnspacing=1.2)
    return canvas.svg


def _residual(ax: Any, d: Diagnosis, data: Data, shown: tuple[Curve, ...], column: int) -> None:
    name = data.names[column]
    sigma = float(data.floor[column])
    sizes = [_largest(c, column, data) for c in shown]
    factor, unit = axis_scale(unit_of(d, name), max(sizes, default=sigma))
    for curve in shown:
        part = _scored_of(curve, data)
        t, r = envelope(curve.fit.problem.data.time[part], residual(curve.fit, column)[part])
        ax.plot(t, factor * r, color=curve.colour, lw=0.7, label=curve.label)
    noise_band(ax, 2 * factor * sigma, "noise, ±2σ")
    held_out(ax, data)
    ax.set_ylabel(label(f"{name}: residual", unit))
    # what was left out would set the scale
    t = data.time[scored(data)]
    ax.set_xlim(t[0], t[-1])


def _scored_of(curve: Curve, data: Data) -> slice:
    """Stretch of a curve that is scored: of the record, unless the curve is thinned."""
    own = curve.fit.problem.data
    return scored(data if own.n == data.n else own)


def _largest(curve: Curve, column: int, data: Data) -> float:
    r = residual(curve.fit, column)[_scored_of(curve, data)]
    return float(np.nanmax(np.abs(r), initial=float(data.floor[column])))


def held_out(ax: Any, data: Data) -> None:
    """Mark the held-out samples of a time plot."""
    parts = (*stretches(data.split.test), *stretches(data.split.looked_at))
    ends = sorted(part.indices(data.n)[:2] for part in parts)
    ends = [(start, stop) for start, stop in ends if stop > start]
    for start, stop in ends:
        named = (start, stop) == ends[-1]
        mark_held_out(ax, float(data.time[start]), float(data.time[stop - 1]), 0.05, named=named)


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
