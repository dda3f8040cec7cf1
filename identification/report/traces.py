"""Long traces made readable: fewer points that keep the peaks, and the piece to look at."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import Array
from identification.statistics.periods import strongest_period

MOST = 1500


def envelope(t: Array, v: Array, most: int = MOST) -> tuple[Array, Array]:
    """Smallest and largest value in each of `most` / 2 pieces: peaks survive thinning."""
    good = np.isfinite(v)
    t, v = t[good], v[good]
    if t.size <= most:
        return t, v
    pieces = np.array_split(np.arange(t.size), most // 2)
    index = np.concatenate([np.sort([p[np.argmin(v[p])], p[np.argmax(v[p])]]) for p in pieces])
    return t[index], v[index]


def thin_log(f: Array, a: Array, most: int = 300) -> tuple[Array, Array]:
    """Root mean square on even steps of the logarithm of the frequency."""
    if f.size <= most:
        return f, a
    edges = np.geomspace(f[0], f[-1] * 1.0001, most + 1)
    index = np.clip(np.searchsorted(edges, f, side="right") - 1, 0, most - 1)
    count = np.bincount(index, minlength=most)
    full = count > 0
    mean_f = np.bincount(index, f, most)[full] / count[full]
    return mean_f, np.sqrt(np.bincount(index, a**2, most)[full] / count[full])


def worst_stretch(y: Array, residual: Array | None, least: int) -> slice:
    """About six oscillations of `y` (at least `least` samples) with most residual.

    The whole when that is most of it; the beginning when no residual is given.
    """
    length = int(np.clip(6 * strongest_period(y), min(least, y.size), y.size))
    if length > 0.6 * y.size:
        return slice(0, y.size)
    if residual is None:
        return slice(0, length)
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(residual) ** 2)])
    first = int(np.argmax(total[length:] - total[:-length]))
    return slice(first, first + length)


def span(marked: Array) -> slice:
    """From the first to the last True; everything where there is none."""
    index = np.flatnonzero(marked)
    return slice(int(index[0]), int(index[-1]) + 1) if index.size else slice(0, marked.size)
