"""Figures of the fit: outputs, residuals and their spectra against the noise floor."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import welch

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report.canvas import drawing, label, plain
from identification.diagnosis.report.numbers import axis_scale
from identification.diagnosis.report.style import BAND, BEFORE, FLOOR, MEASURED, MUTED
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


def outputs_figure(d: Diagnosis) -> str:
    """Measured against simulated readings on a readable piece of the held-out samples."""
    shown, data = curves(d), d.data
    assert data is not None
    n = len(data.names)
    with drawing("outputs", 0.5 + 2.2 * n) as canvas:
        axes = canvas.rows(n)[:, 0]
        for c, (ax, name) in enumerate(zip(axes, data.names, strict=True)):
            _output(ax, d, shown, c, name)
        axes[-1].set_xlabel("time (s)")
        _legend(canvas.figure, axes[0])
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
        ax.plot(ts, factor * ys, color=curve.colour, ls=style, label=plain(curve.label))
    ax.set_ylabel(label(name, unit))
    ax.set_xlim(t[0], t[-1])


def residuals_figure(d: Diagnosis) -> str:
    """Residuals over time and their spectra, each with the noise floor."""
    shown, data = curves(d), d.data
    assert data is not None
    n = len(data.names)
    with drawing("residuals", 0.5 + 2.4 * n) as canvas:
        grid = canvas.figure.subplots(n, 2, squeeze=False, gridspec_kw={"width_ratios": [1.5, 1]})
        for c, name in enumerate(data.names):
            _residual(grid[c, 0], d, shown, c, name)
            _spectrum(grid[c, 1], d, shown, c, name)
        grid[-1, 0].set_xlabel("time (s)")
        grid[-1, 1].set_xlabel("frequency (Hz)")
        _legend(canvas.figure, grid[0, 0])
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
        ax.plot(t, factor * r, color=curve.colour, lw=0.7, label=plain(curve.label))
    ax.axhspan(
        -2 * factor * sigma, 2 * factor * sigma, color=BAND, lw=0, zorder=1,
        label="noise floor, ±2σ",
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


def _spectrum(ax: Any, d: Diagnosis, shown: tuple[Curve, ...], column: int, name: str) -> None:
    data = d.data
    assert data is not None
    level = float(data.floor[column]) * np.sqrt(2 * data.dt)
    spectra = [(c, *_density(c, column)) for c in shown]
    size = max([float(a.max(initial=level)) for _, _, a in spectra], default=level)
    factor, unit = axis_scale(unit_of(d, name), size)
    for curve, f, a in spectra:
        if f.size:
            ax.loglog(f, factor * a, color=curve.colour, lw=0.9)
    ax.axhline(factor * level, color=FLOOR, lw=1.4, ls="--")
    ax.set_ylabel(plain(f"{name}: residual ({unit or 1}/√Hz)"))
    ax.grid(True, which="major")


def _density(curve: Curve, column: int) -> tuple[Array, Array]:
    """Frequencies and amplitude density of the held-out residual."""
    data = curve.fit.problem.data
    r = residual(curve.fit, column)[data.mask("test")]
    r = r[np.isfinite(r)]
    if r.size < 16:
        return np.zeros(0), np.zeros(0)
    f, p = welch(r, fs=1 / data.dt, nperseg=min(r.size, max(2048, r.size // 2)), detrend="constant")
    return thin_log(f[1:], np.sqrt(p[1:]))


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
    with drawing("recording", 0.4 + 1.3 * len(names)) as canvas:
        axes = canvas.rows(len(names))[:, 0]
        for ax, name in zip(axes, names, strict=True):
            y = np.asarray(d.recording[name])
            factor, unit = axis_scale(unit_of(d, name), float(np.abs(y).max(initial=0.0)))
            t, v = envelope(np.asarray(d.recording.time), factor * y)
            ax.plot(t, v, color=MEASURED, lw=0.9)
            ax.set_ylabel(label(name, unit))
        axes[-1].set_xlabel("time (s)")
    return canvas.svg


def power_figure(d: Diagnosis, bins: int = 120) -> str:
    """Mean square residual over the floor along the recording."""
    shown, data = curves(d), d.data
    assert data is not None
    with drawing("power", 2.3) as canvas:
        ax = canvas.rows(1)[0, 0]
        for curve in shown:
            other = curve.fit.problem.data
            square = np.mean(((other.readings - curve.fit.simulated) / other.floor) ** 2, axis=1)
            index = np.arange(other.n)[scored(other)]
            pieces = np.array_split(index, min(bins, index.size))
            t = np.array([other.time[p].mean() for p in pieces])
            v = np.array([_mean(square[p]) for p in pieces])
            ax.semilogy(t, v, color=curve.colour, drawstyle="steps-mid", label=plain(curve.label))
        ax.axhline(1.0, color=FLOOR, ls="--", lw=1.2, label="noise floor")
        start, stop = bounds(data.split.test, data.n)
        held_out(ax, data.time, start, stop)
        for r in d.regions:
            if r.axis == "time" and r.density > 1.3:
                ax.axvspan(r.low, r.high, color=BEFORE, alpha=0.12, lw=0, label="densest tenth")
        _scored_axis(ax, d)
        ax.set_xlabel("time (s)")
        ax.set_ylabel("residual power / floor")
        _legend(canvas.figure, ax)
    return canvas.svg


def _mean(v: Array) -> float:
    v = v[np.isfinite(v)]
    return float(v.mean()) if v.size else float("nan")


def _legend(figure: Any, ax: Any) -> None:
    handles, texts = ax.get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside upper left", ncols=len(texts))
