"""What the report looks at: the fits to compare, units, and a readable part of the record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.signals.split import stretches
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report.found import after_of
from identification.diagnosis.report.style import AFTER, BEFORE
from identification.estimation.single_record import Fit
from identification.study.problem import Data

Array = np.ndarray
MOST = 1500


@dataclass(frozen=True)
class Curve:
    """A fit with the word and the colour it has all over the report."""

    label: str
    fit: Fit
    colour: str


def curves(d: Diagnosis) -> tuple[Curve, ...]:
    """Fits to compare, before first."""
    if d.nominal is None:
        return ()
    if d.kind == "parameters_only" and d.declared is not None:
        return (
            Curve("declared values", d.declared, BEFORE),
            Curve("fitted values", d.nominal, AFTER),
        )
    after = after_of(d)
    if after is not None:
        word = "repaired" if d.kind == "missing_physics" else "closest"
        return Curve("nominal", d.nominal, BEFORE), Curve(word, after, AFTER)
    return (Curve("nominal", d.nominal, AFTER if d.kind == "explained" else BEFORE),)


def unit_of(d: Diagnosis, name: str) -> str:
    """SI unit of a channel, else of the element of that name."""
    found = d.recording.units.get(name) if name in d.recording.units else None
    if found is None and name in d.graph.elements:
        found = getattr(d.graph[name], "unit", "")
    return "" if found in (None, "1") else str(found)


def bounds(part: slice | tuple[slice, ...], n: int) -> tuple[int, int]:
    """First sample and end of a part of a record of `n` samples; of its last stretch."""
    start, stop, _ = stretches(part)[-1].indices(n)
    return start, stop


def readable(data: Data, column: int, residual: Array | None = None) -> slice:
    """Piece of the held-out samples with about six oscillations, where `residual` is largest."""
    start, stop = bounds(data.split.test, data.n)
    y = data.readings[start:stop, column]
    length = int(np.clip(6 * _period(y), min(240, y.size), y.size))
    if length > 0.6 * y.size:
        return slice(start, stop)
    if residual is None:
        return slice(start, start + length)
    power = np.nan_to_num(residual[start:stop]) ** 2
    total = np.concatenate([[0.0], np.cumsum(power)])
    first = int(np.argmax(total[length:] - total[:-length]))
    return slice(start + first, start + first + length)


def _period(y: Array) -> float:
    """Count the samples of the oscillation that carries most of the power."""
    if y.size < 8 or np.ptp(y) == 0:
        return float(y.size)
    spectrum = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(y.size)))
    spectrum[0] = 0.0
    peak = int(np.argmax(spectrum))
    return y.size / max(peak, 1)


def sampled(t: Array, *values: Array, most: int = MOST) -> tuple[Array, ...]:
    """Every k-th sample, at most `most`."""
    step = max(1, -(-t.size // most))
    return (t[::step], *(v[::step] for v in values))


def envelope(t: Array, v: Array, most: int = MOST) -> tuple[Array, Array]:
    """Smallest and largest value in each of `most` / 2 pieces: peaks survive thinning."""
    good = np.isfinite(v)
    t, v = t[good], v[good]
    if t.size <= most:
        return t, v
    pieces = np.array_split(np.arange(t.size), most // 2)
    index = np.concatenate([np.sort([p[np.argmin(v[p])], p[np.argmax(v[p])]]) for p in pieces])
    return t[index], v[index]


def scored(data: Data) -> slice:
    """Stretch of the record from the first to the last sample that is scored."""
    index = np.flatnonzero(data.mask("train") | data.mask("test"))
    return slice(int(index[0]), int(index[-1]) + 1) if index.size else slice(0, data.n)


def residual(f: Fit, column: int) -> Array:
    """Measured less simulated on the whole record, SI, shape (N,)."""
    return np.asarray(f.problem.data.readings[:, column] - f.simulated[:, column])
