"""Whether a command repeats itself, and how often."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import FloatArray as Array

REPEATS = 3e-4
"""Share of the power that may be left beside fundamental and harmonics."""
HARMONICS = 20
FITTED = 3000
STEEPEST = 3.0
"""Largest slope over the mean of the slopes: 1.6 for a sine, 1 for a triangle."""


def fundamental(volts: Array, rate: float) -> float | None:
    """Return the frequency (Hz) of a periodic command with 3 periods or more, None for others.

    Parameters
    ----------
    volts : ndarray
        (m,), even. A tenth at either end is passed over: rest, or ramps.
    rate : float
        Hz.
    """
    m = volts.size
    v = volts[m // 10 : m - m // 10]
    n = v.size
    if n < 64 or not float(np.ptp(v)) > 0.0:
        return None
    v = v - v.mean()
    window = np.hanning(n)
    spectrum = np.abs(np.fft.rfft(v * window, 4 * n))
    peak = int(np.argmax(spectrum))
    a, b, c = np.log(np.maximum(spectrum[max(peak - 1, 0) : peak + 2], 1e-300))
    line = rate * (peak + 0.5 * (a - c) / (a - 2 * b + c)) / (4 * n)
    # a signal of period P may have its strongest line at a multiple of 1/P
    stride = max(n // FITTED, 1)
    kept = np.arange(0, n - stride, stride)
    kept = kept + (7919 * np.arange(kept.size)) % stride  # uneven, so that nothing aliases
    t, w = np.asarray((kept - 0.5 * n) / rate, float), np.asarray(v[kept], float)
    for part in (1, 2, 3, 4, 5):
        f = _refined(w, t, line / part)
        if n * f / rate >= 2.4 and _left(w, t, f, rate) < REPEATS:
            return f
    return None


def one_loop(volts: Array, rate: float, frequency: float) -> bool:
    """Return whether each period is one smooth rise and one smooth fall: one loop, no edges."""
    m = volts.size
    moved = np.diff(volts[m // 10 : m - m // 10])
    moved = moved[np.abs(moved) > 1e-9 * float(np.ptp(volts))]
    turns = int(np.count_nonzero(np.diff(np.sign(moved))))
    smooth = float(np.abs(moved).max()) <= STEEPEST * float(np.abs(moved).mean())
    return smooth and turns <= 2.5 * 0.8 * m * frequency / rate + 2


def _refined(v: Array, t: Array, f: float) -> float:
    """Newton steps: a wave of the right frequency leaves no part that grows with time."""
    for _ in range(4):
        wave = _waves(t, f, 6)
        a = np.column_stack([np.ones(t.size), wave, t[:, None] * wave])
        c, *_ = np.linalg.lstsq(a, v, rcond=1e-12)
        still, growing = c[1:13].reshape(-1, 2), c[13:].reshape(-1, 2)
        size = np.sum(still**2, axis=1)
        h = int(np.argmax(size))
        turn = still[h, 1] * growing[h, 0] - still[h, 0] * growing[h, 1]
        f += float(turn / size[h]) / (2.0 * np.pi * (h + 1))
    return f


def _waves(t: Array, f: float, count: int) -> Array:
    angle = 2.0 * np.pi * f * t
    return np.column_stack([w(h * angle) for h in range(1, count + 1) for w in (np.cos, np.sin)])


def _left(v: Array, t: Array, f: float, rate: float) -> float:
    """Share of the power that harmonics leave."""
    count = int(np.clip(0.5 * rate / f - 0.01, 1, HARMONICS))
    a = np.column_stack([np.ones(t.size), _waves(t, f, count)])
    c, *_ = np.linalg.lstsq(a, v, rcond=1e-12)
    return float(np.sum((v - a @ c) ** 2) / np.sum(v**2))
