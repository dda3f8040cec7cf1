"""Misfit by the state of a port: over displacement and velocity, along its history, as data."""

from __future__ import annotations

from typing import Any

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.recording import MisfitAxis, axes_of
from identification.diagnosis.localisation.recording.binned import heat_map, profile
from identification.diagnosis.report.views import curves, residual
from identification.diagnosis.studio.packing import packed, typical
from identification.estimation.single_record import Fit
from identification.report.numbers import axis_scale

LEAST = 1e-12
"""Mean square below which nothing is drawn."""


def port_misfits(d: Diagnosis) -> dict[str, Any]:
    """Return, by element that moves, the rms misfit over the noise of the worst reading.

    Maps over displacement and velocity, one a fit; profiles along history and displacement with
    two standard errors. Empty where histories and fits are not of the same samples.
    """
    if d.nominal is None or d.scene is None or d.scene.data.n != d.nominal.problem.data.n:
        return {}
    column = _worst(d.nominal)
    fits = [(c.label, *own) for c in curves(d) if (own := _square(c.fit, d, column))]
    found: dict[str, Any] = {}
    for name, past in d.scene.past.items():
        axes = axes_of(d.graph, name, past, d.recording.read_in) if name in d.graph.elements else ()
        if len(axes) == 3 and fits:
            found[name] = _port(axes, fits) | {"of": d.nominal.problem.data.names[column]}
    return found


def _worst(f: Fit) -> int:
    """Column of the reading whose misfit is largest over its floor."""
    r = f.residuals("test") / f.problem.data.floor
    return int(np.argmax(np.mean(r**2, axis=0)))


def _square(f: Fit, d: Diagnosis, column: int) -> tuple[Array, Array] | None:
    """Mask of usable samples and squared residual over the floor; None on another time grid."""
    data = f.problem.data
    if d.data is None or data.n != d.data.n:
        return None
    r = residual(f, column) / data.floor[column]
    keep = (data.mask("train") | data.mask("test")) & np.isfinite(r)
    return (keep, r[keep] ** 2) if keep.sum() >= 64 else None


def _port(axes: tuple[MisfitAxis, ...], fits: list[tuple[str, Array, Array]]) -> dict[str, Any]:
    amplitude, velocity, history = axes
    near = typical(amplitude.values) & typical(velocity.values) & typical(history.values)
    fits = [(label, keep & near, square[near[keep]]) for label, keep, square in fits]
    (fx, xl), (fy, yl) = _scale(amplitude, near), _scale(velocity, near)
    maps = []
    for label, keep, square in fits:
        m = heat_map(fx * amplitude.values[keep], fy * velocity.values[keep], square)
        ends = {"x": [float(m.x[0]), float(m.x[-1])], "y": [float(m.y[0]), float(m.y[-1])]}
        maps.append(
            {"label": label, "columns": m.x.size - 1, "mean": packed(np.sqrt(m.mean)), **ends}
        )
    return {
        "xLabel": xl, "yLabel": yl, "maps": maps,
        "profiles": [_profile(a, fits, near) for a in (history, amplitude)],
    }  # fmt: skip


def _scale(a: MisfitAxis, near: Array) -> tuple[float, str]:
    factor, unit = axis_scale(a.unit, float(np.nanmax(np.abs(a.values[near]), initial=0.0)))
    return factor, f"{a.name} ({unit})" if unit else a.name


def _profile(a: MisfitAxis, fits: list[tuple[str, Array, Array]], near: Array) -> dict[str, Any]:
    factor, label = _scale(a, near)
    found = [profile(a.values[keep], square) for _, keep, square in fits]
    return {
        "xLabel": label,
        "curves": [
            {"x": packed(factor * p.centre), "y": packed(root), "e": packed(p.error / root)}
            for p, root in ((p, np.sqrt(np.maximum(p.mean, LEAST))) for p in found)
        ],
    }
