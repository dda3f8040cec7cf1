"""Where in the recording the model fails: times, frequencies, amplitudes, speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.fit import Fit

Array = np.ndarray
BINS = 10


@dataclass(frozen=True)
class Region:
    """Part of an axis that carries more than its share of the misfit.

    Attributes
    ----------
    axis : str
        ``time``, ``frequency``, ``command`` or ``command rate``.
    low, high : float, SI
    share : float
        Part of the squared residual that falls here.
    density : float
        `share` over the part of the samples that falls here.
    """

    axis: str
    low: float
    high: float
    share: float
    density: float
    unit: str

    def __str__(self) -> str:
        """Sentence."""
        return (
            f"{self.axis} {_round(self.low, self)} .. {_round(self.high, self)} {self.unit}: "
            f"{100 * self.share:.0f} % of the misfit ({self.density:.1f} times its share of "
            "the samples)"
        )


def _round(v: float, region: Region) -> str:
    """Three digits of the larger end; rounding noise reads as zero."""
    size = max(abs(region.low), abs(region.high))
    return f"{0.0 if abs(v) < 1e-6 * size else v:.4g}"


def regions(fit: Fit) -> tuple[Region, ...]:
    """Densest region of each axis, densest axis first."""
    data = fit.problem.data
    scored = data.mask("train") | data.mask("test")
    scored &= np.isfinite(fit.simulated).all(axis=1)
    residual = (data.readings - fit.simulated)[scored] / data.floor
    weight = np.mean(residual**2, axis=1)
    time = data.time[scored]

    def unit(name: str) -> str:
        return str(getattr(fit.problem.graph[name], "unit", ""))

    found = [_densest("time", time, weight, "s", even=True)]
    for name, u in data.commands.items():
        v = u[scored]
        if np.ptp(v) > 0:
            found.append(_densest(f"command {name}", v, weight, unit(name)))
            found.append(
                _densest(
                    f"rate of {name}", np.gradient(u, data.dt)[scored], weight, f"{unit(name)}/s"
                )
            )
    found.append(_band(residual, data.dt))
    return tuple(sorted((r for r in found if r is not None), key=lambda r: -r.density))


def _densest(
    axis: str, values: Array, weight: Array, unit: str, even: bool = False
) -> Region | None:
    total = float(weight.sum())
    if total <= 0 or values.size < 4 * BINS:
        return None
    if even:
        edges = np.linspace(values.min(), values.max(), BINS + 1)
    else:
        edges = np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))
    if edges.size < 3:
        return None
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
    share = np.bincount(index, weight, edges.size - 1) / total
    part = np.bincount(index, minlength=edges.size - 1) / values.size
    density = np.where(part > 0, share / np.maximum(part, 1e-12), 0.0)
    k = int(np.argmax(density))
    return Region(
        axis, float(edges[k]), float(edges[k + 1]), float(share[k]), float(density[k]), unit
    )


def _band(residual: Array, dt: float) -> Region | None:
    if residual.shape[0] < 64:
        return None
    spectrum = np.sum(np.abs(np.fft.rfft(residual - residual.mean(axis=0), axis=0)) ** 2, axis=1)[
        1:
    ]
    if not spectrum.any():
        return None
    frequency = np.fft.rfftfreq(residual.shape[0], dt)[1:]
    edges = np.geomspace(frequency[0], frequency[-1] * 1.0001, BINS + 1)
    index = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, BINS - 1)
    share = np.bincount(index, spectrum, BINS) / spectrum.sum()
    part = np.bincount(index, minlength=BINS) / frequency.size
    k = int(np.argmax(share))
    return Region(
        "frequency", float(edges[k]), float(edges[k + 1]), float(share[k]),
        float(share[k] / max(part[k], 1e-12)), "Hz",
    )  # fmt: skip


def summary(found: Sequence[Region]) -> tuple[str, ...]:
    """Sentences for the regions that stand out."""
    return tuple(str(r) for r in found if r.density > 1.3)
