"""The period of a drive, in samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from bondgraph.support.errors import UnusableInput

__all__ = ["find_period", "whole_period"]

FloatArray = NDArray[np.float64]

LEAST_LIKENESS = 0.9
"""Autocorrelation that a drive must reach at its period."""

MISCOUNT = 0.25
"""Largest drift of the period against the samples over the whole record, samples."""


def find_period(drive: FloatArray, where: str = "drive") -> float:
    """Return the period of a drive in samples; fractions are possible.

    The first peak of the normalised autocorrelation that comes within 0.005 of the highest, as
    long as no multiple of it halves the difference between the drive and its shifted copy.

    Parameters
    ----------
    drive : ndarray, shape (N,)
        At least two periods.
    where : str
        Name of the drive, for messages.

    Raises
    ------
    UnusableInput
        If the drive rests or does not repeat.

    Examples
    --------
    >>> round(find_period(np.sin(2 * np.pi * np.arange(200) / 25)), 1)
    25.0
    """
    n = drive.size
    v = np.asarray(drive, float) - np.mean(drive)
    if n < 8 or not np.ptp(v) > 0.0:
        raise UnusableInput(f"{where}: it does not move, so it has no period; name the drive")
    lags = n // 2 + 2
    size = next_fast_len(n + lags, real=True)
    raw = irfft(np.abs(rfft(v, size)) ** 2, size)[:lags]
    energy = np.concatenate(([0.0], np.cumsum(v * v)))
    k = np.arange(min(lags, n))
    norm = np.sqrt(energy[n - k] * (energy[n] - energy[k]))
    r = np.divide(raw[k], norm, out=np.zeros(k.size), where=norm > 1e-12 * energy[n])
    first = _first_peak(r, where)
    period = _refined(r, first)
    best = _difference(v, round(period))
    rounding = abs(period - round(period)) * float(np.sqrt(np.mean(np.diff(v) ** 2)))
    if best < 2.0 * rounding:
        return period
    for multiple in range(2, 9):
        lag = round(multiple * period)
        if lag > n // 2:
            break
        if _difference(v, lag) < 0.5 * best:
            return _refined(r, lag)
    return period


def _first_peak(r: FloatArray, where: str) -> int:
    below = np.flatnonzero(r < 0.5)
    inner = np.arange(max(1, int(below[0])) if below.size else r.size, r.size - 1)
    peaks = inner[(r[inner] >= r[inner - 1]) & (r[inner] >= r[inner + 1])]
    good = peaks[r[peaks] >= LEAST_LIKENESS]
    if not good.size:
        best = f"; it is most like itself ({r[peaks].max():.2f})" if peaks.size else ""
        raise UnusableInput(
            f"{where}: it does not repeat within half of the record{best}; record at least two "
            "periods or use local_polynomial, which needs none"
        )
    return int(good[r[good] >= r[good].max() - 0.005][0])


def _refined(r: FloatArray, first: int) -> float:
    """Vertex of the parabola at the peak, then at its multiples, which divide the error."""
    period, multiple = _vertex(r, first), 2
    while multiple * period < r.size - 2:
        near, reach = round(multiple * period), max(1, int(0.02 * period))
        low, high = max(1, near - reach), min(r.size - 1, near + reach + 1)
        period = _vertex(r, low + int(np.argmax(r[low:high]))) / multiple
        multiple *= 2
    return period


def _vertex(r: FloatArray, k: int) -> float:
    if not 0 < k < r.size - 1:
        return float(k)
    a, b, c = (float(x) for x in r[k - 1 : k + 2])
    bend = a - 2.0 * b + c
    return k + (0.5 * (a - c) / bend if bend < 0.0 else 0.0)


def _difference(v: FloatArray, lag: int) -> float:
    return float(np.sqrt(np.mean((v[lag:] - v[:-lag]) ** 2)))


def whole_period(period: float, n: int, where: str) -> int:
    """Return the smallest multiple of `period` that is a whole number of samples over n samples.

    Raises
    ------
    UnusableInput
        If there is none within half of the record.
    """
    for multiple in range(1, 17):
        samples = round(multiple * period)
        if not 1 < samples <= n // 2:
            break
        if abs(multiple * period - samples) * (n / samples) <= MISCOUNT:
            return samples
    raise UnusableInput(
        f"{where}: its period of {period:.6g} samples is no whole number of samples; lock the "
        "clocks of generator and recorder, resample, or give period= and accept leakage"
    )
