"""The period of a signal, in samples: likeness, strongest line, exact repetition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.signals.repeating import first_peak, likeness, refined
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput

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
    r = likeness(v)
    first, highest = first_peak(r, LEAST_LIKENESS)
    if not first:
        said = f"; it is most like itself ({highest:.2f})" if highest > 0 else ""
        raise UnusableInput(
            f"{where}: it does not repeat within half of the record{said}; record at least two "
            "periods or use local_polynomial, which needs none"
        )
    period = refined(r, first, 0.02)
    best = _difference(v, round(period))
    rounding = abs(period - round(period)) * float(np.sqrt(np.mean(np.diff(v) ** 2)))
    if best < 2.0 * rounding:
        return period
    for multiple in range(2, 9):
        lag = round(multiple * period)
        if lag > n // 2:
            break
        if _difference(v, lag) < 0.5 * best:
            return refined(r, lag, 0.02)
    return period


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


def strongest_period(y: FloatArray) -> float:
    """Count the samples of the oscillation that carries most of the power; all if none does."""
    if y.size < 8 or np.ptp(y) == 0:
        return float(y.size)
    spectrum = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(y.size)))
    return y.size / max(int(np.argmax(spectrum[1:])) + 1, 1)


def repeats(commands: Sequence[FloatArray]) -> tuple[int, list[slice]] | None:
    """Period in samples and the stretches that a whole period later look exactly the same.

    None when the commands do not repeat themselves, as with feedback or a sweep.
    """
    n = commands[0].size
    v = commands[0] - commands[0].mean()
    power = np.abs(np.fft.rfft(v, 2 * n)) ** 2
    likeness = np.fft.irfft(power)[: n // 2 + 1] / max(float(v @ v), 1e-300)
    size = likeness * n / np.maximum(n - np.arange(likeness.size), 1)
    inner = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:]) & (size[1:-1] > 0.5))
    for lag in (inner + 1)[np.argsort(-size[inner + 1], kind="stable")][:12]:
        if lag < 32:
            continue
        same = np.ones(n - lag, bool)
        for u in commands:
            same &= np.abs(u[lag:] - u[:-lag]) <= 1e-9 * np.ptp(u)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], same.astype(int), [0]])))
        runs = [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2) if b - a >= 0.9 * lag]
        # a command that stands still repeats itself too
        runs = [s for s in runs if all(np.ptp(u[s]) > 0.1 * np.ptp(u) for u in commands)]
        if runs:
            return int(lag), runs
    return None
