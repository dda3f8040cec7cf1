"""After how many samples a signal repeats itself."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import FloatArray


def likeness(v: FloatArray) -> FloatArray:
    """Normalised autocorrelation of `v` (N,), which has no mean, at lags 0 .. N / 2 + 1."""
    m = v.size
    size = 1 << (2 * m - 1).bit_length()
    lags = min(m // 2 + 2, m)
    raw = np.fft.irfft(np.abs(np.fft.rfft(v, size)) ** 2, size)[:lags]
    energy = np.concatenate(([0.0], np.cumsum(v * v)))
    k = np.arange(lags)
    norm = np.sqrt(energy[m - k] * (energy[m] - energy[k]))
    return np.asarray(np.divide(raw, norm, out=np.zeros(lags), where=norm > 1e-12 * energy[m]))


def first_peak(r: FloatArray, least: float) -> tuple[int, float]:
    """Return the first peak within 0.005 of the highest, and how high the highest is.

    Peaks count from the first value below 0.5 on. The lag is 0 where none reaches `least`; the
    height is 0 where there is no peak at all.
    """
    below = np.flatnonzero(r < 0.5)
    inner = np.arange(max(1, int(below[0])) if below.size else r.size, r.size - 1)
    peaks = inner[(r[inner] >= r[inner - 1]) & (r[inner] >= r[inner + 1])]
    highest = float(r[peaks].max(initial=0.0))
    good = peaks[(r[peaks] >= least) & (r[peaks] >= highest - 0.005)]
    return (int(good[0]) if good.size else 0), highest


def refined(r: FloatArray, first: int, reach: float) -> float:
    """Vertex of the parabola at the peak, then at its multiples, which divide the error.

    Parameters
    ----------
    reach : float
        Share of the period within which a multiple is looked for.
    """
    period, count = _vertex(r, first), 2
    while count * period < r.size - 2:
        near, width = round(count * period), max(1, int(reach * period))
        low, high = max(1, near - width), min(r.size - 1, near + width + 1)
        period = _vertex(r, low + int(np.argmax(r[low:high]))) / count
        count *= 2
    return period


def _vertex(r: FloatArray, k: int) -> float:
    """Place of the maximum of the parabola through three neighbours."""
    if not 0 < k < r.size - 1:
        return float(k)
    a, b, c = (float(x) for x in r[k - 1 : k + 2])
    bend = a - 2.0 * b + c
    return k + (0.5 * (a - c) / bend if bend < 0.0 else 0.0)
