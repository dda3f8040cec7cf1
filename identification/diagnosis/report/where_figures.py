"""Pictures of where a model fails: time, frequency, the state of a port, its history."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm

from bondgraph.support.arrays import Array
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.recording import MisfitAxis, axes_of
from identification.diagnosis.localisation.recording.bands import spectrum
from identification.diagnosis.localisation.recording.binned import HeatMap, heat_map, profile
from identification.diagnosis.localisation.regions import Region
from identification.diagnosis.report.fit_figures import held_out
from identification.diagnosis.report.views import (
    curves,
    residual,
    scored,
    unit_of,
)
from identification.estimation.single_record import Fit
from identification.report.canvas import TILE, drawing, label, logarithmic, plain
from identification.report.numbers import axis_scale
from identification.report.style import BAND, BEFORE, FLOOR
from identification.report.traces import envelope, thin_log

Numbered = Sequence[tuple[int, Region]]
SHADE = "#c2410c"


def time_tile(d: Diagnosis, column: int, numbered: Numbered) -> str:
    """Residual of the nominal model over time, its worst stretches shaded and numbered."""
    data, f = d.data, d.nominal
    assert data is not None
    assert f is not None
    name, part = data.names[column], scored(data)
    t, r = envelope(data.time[part], residual(f, column)[part], 900)
    sigma = float(data.floor[column])
    factor, unit = axis_scale(unit_of(d, name), float(np.abs(r).max(initial=sigma)))
    with drawing(f"where-time-{column}", 2.3, TILE) as canvas:
        ax = canvas.ax
        ax.plot(t, factor * r, color=BEFORE, lw=0.7)
        ax.axhspan(-2 * factor * sigma, 2 * factor * sigma, color=BAND, lw=0, zorder=1)
        for number, region in numbered:
            if region.kind == "time" and region.channel in ("", name):
                _shade(ax, region.low, region.high, number)
        held_out(ax, data)
        ax.set_xlim(t[0], t[-1])
        ax.set_ylabel(label(f"{name}: residual", unit))
        ax.set_xlabel("time (s)")
    return canvas.svg


def spectrum_tile(d: Diagnosis, column: int, numbered: Numbered) -> str:
    """Power of the residual over the floor's, the worst bands shaded and numbered."""
    data = d.data
    assert data is not None
    name = data.names[column]
    with drawing(f"where-band-{column}", 2.3, TILE) as canvas:
        ax = canvas.ax
        for curve in curves(d):
            own = curve.fit.problem.data
            r = residual(curve.fit, column)[scored(own)]
            r = r[np.isfinite(r)]
            if r.size < 64:
                continue
            f, power = spectrum(r, float(own.floor[column]), own.dt)
            f, power = thin_log(f, np.sqrt(power), 160)
            ax.loglog(f, np.maximum(power, 1e-3), color=curve.colour, lw=0.9)
        ax.axhline(1.0, color=FLOOR, lw=1.3, ls="--")
        logarithmic(ax.xaxis)
        logarithmic(ax.yaxis)
        for number, region in numbered:
            if region.kind == "frequency" and region.channel in ("", name):
                _shade(ax, region.low, region.high, number)
        ax.set_xlabel("frequency (Hz)")
        ax.set_ylabel(plain(f"{name}: residual / floor"))
    return canvas.svg


def _shade(ax: Any, low: float, high: float, number: int) -> None:
    ax.axvspan(low, high, color=SHADE, alpha=0.13, lw=0)
    middle = np.sqrt(low * high) if ax.get_xscale() == "log" and low > 0 else 0.5 * (low + high)
    ax.annotate(
        str(number), (middle, 0.97), xycoords=ax.get_xaxis_transform(), ha="center", va="top",
        fontsize=9, fontweight="bold", color=SHADE,
    )  # fmt: skip


def port_tiles(d: Diagnosis, element: str) -> list[tuple[str, str]]:
    """Figures with captions of the misfit over displacement, velocity and history of a port."""
    axes = _axes(d, element)
    if d.nominal is None or len(axes) < 3:
        return []
    column = _worst(d)
    name = d.nominal.problem.data.names[column]
    amplitude, velocity, history = axes[:3]
    maps = []
    for curve in curves(d):
        found = _square(curve.fit, d, column)
        if found is not None:
            keep, square = found
            x, y = amplitude.values[keep], velocity.values[keep]
            maps.append((curve.label, heat_map(x, y, square)))
    tiles = [
        (
            _heat(f"heat-{k}-{element}", m, amplitude, velocity, _range(maps)),
            f"{words.capitalize()} model: mean square misfit of {name} over the "
            f"floor, by {amplitude.name} and {velocity.name}. White: hardly visited.",
        )
        for k, (words, m) in enumerate(maps)
    ]
    slope = "A law with memory that is missing shows as a slope here; noise alone lies at 1."
    bars = f"Misfit of {name} by {amplitude.name}; bars are two standard errors."
    return [
        *tiles,
        (_profiles(d, history, column, f"history-{element}"),
         f"Misfit of {name} by {history.name}. {slope}"),
        (_profiles(d, amplitude, column, f"amplitude-{element}"), bars),
    ]  # fmt: skip


def _axes(d: Diagnosis, element: str) -> tuple[MisfitAxis, ...]:
    if d.nominal is None or d.scene is None or d.scene.data.n != d.nominal.problem.data.n:
        return ()  # histories of a thinned record do not go with the fits of the whole one
    if element not in d.scene.past or element not in d.graph.elements:
        return ()
    return axes_of(d.graph, element, d.scene.past[element])


def _worst(d: Diagnosis) -> int:
    """Column of the reading whose misfit is largest over its floor."""
    assert d.nominal is not None
    r = d.nominal.residuals("test") / d.nominal.problem.data.floor
    return int(np.argmax(np.mean(r**2, axis=0)))


def _square(f: Fit, d: Diagnosis, column: int) -> tuple[Array, Array] | None:
    """Mask of usable samples and squared residual over the floor; None on another time grid."""
    data = f.problem.data
    if d.data is None or data.n != d.data.n:
        return None
    r = residual(f, column) / data.floor[column]
    keep = (data.mask("train") | data.mask("test")) & np.isfinite(r)
    return (keep, r[keep] ** 2) if keep.sum() >= 64 else None


def _range(maps: list[tuple[str, HeatMap]]) -> tuple[float, float]:
    values = np.concatenate([m.mean[np.isfinite(m.mean)] for _, m in maps])
    values = values[values > 0]
    if not values.size:
        return 1.0, 10.0
    low = min(1.0, float(values.min()))
    return low, max(float(values.max()), 3.0 * low)


def _heat(name: str, m: HeatMap, x: MisfitAxis, y: MisfitAxis, span: tuple[float, float]) -> str:
    fx, ux = axis_scale(x.unit, float(np.abs(m.x).max()))
    fy, uy = axis_scale(y.unit, float(np.abs(m.y).max()))
    with drawing(name, 2.7, TILE) as canvas:
        ax = canvas.ax
        drawn = ax.pcolormesh(
            fx * m.x, fy * m.y, np.ma.masked_invalid(np.maximum(m.mean, span[0])), cmap="YlOrRd",
            norm=LogNorm(*span),
        )  # fmt: skip
        ax.grid(False)
        ax.set_xlabel(label(x.name, ux))
        ax.set_ylabel(label(y.name, uy))
        scale = canvas.figure.colorbar(drawn, ax=ax, pad=0.02, aspect=18)
        scale.set_label("misfit / floor")
        logarithmic(scale.ax.yaxis)
    return canvas.svg


def _profiles(d: Diagnosis, axis: MisfitAxis, column: int, name: str) -> str:
    factor, unit = axis_scale(axis.unit, float(np.nanmax(np.abs(axis.values))))
    with drawing(name, 2.4, TILE) as canvas:
        ax = canvas.ax
        for curve in curves(d):
            found = _square(curve.fit, d, column)
            if found is None:
                continue
            keep, square = found
            p = profile(axis.values[keep], square)
            ax.errorbar(
                factor * p.centre, p.mean, 2 * np.minimum(p.error, 0.49 * p.mean), fmt="o-", ms=3,
                lw=1.0, elinewidth=0.8, color=curve.colour, label=curve.label,
            )  # fmt: skip
        ax.axhline(1.0, color=FLOOR, ls="--", lw=1.2)
        ax.set_yscale("log")
        logarithmic(ax.yaxis)
        ax.set_xlabel(label(axis.name, unit))
        ax.set_ylabel("misfit / floor")
        ax.legend(loc="best")
    return canvas.svg
