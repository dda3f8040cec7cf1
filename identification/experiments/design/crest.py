"""Phases of a multisine: random, Schroeder's, or those of a low crest factor.

The crest factor is the peak over the root mean square of the course, between samples too. Clipping
(van der Ouderaa, Schoukens, Renneboog, IEEE Trans. Instrum. Meas. 37 (1988) 145) repeats: cut the
tops off, take the phases of what is left, restore the amplitudes. The L_p norms with growing p
(Guillaume et al., IEEE Trans. Instrum. Meas. 40 (1991) 982) finish.
"""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from bondgraph.support.arrays import FloatArray, IntArray
from bondgraph.support.errors import require_known

PHASES = ("random", "schroeder", "low_crest")


def course(lines: IntArray, amplitudes: FloatArray, phases: FloatArray, size: int) -> FloatArray:
    """Return ``sum a_k cos(2 pi k n / size + phi_k)`` for n = 0 .. size - 1; size > 2 max(k)."""
    spectrum = np.zeros(size // 2 + 1, complex)
    spectrum[lines] = 0.5 * size * amplitudes * np.exp(1j * phases)
    return np.asarray(irfft(spectrum, size))


def crest_factor(lines: IntArray, amplitudes: FloatArray, phases: FloatArray) -> float:
    """Return an upper bound of the crest factor of the continuous course, within 0.13 %.

    The largest of L > 2 n even samples of a trigonometric polynomial of degree n falls short of
    its maximum by no more than ``cos(pi n / L)`` (Ehlich and Zeller, Math. Z. 86 (1964) 41).
    """
    n = int(lines.max())
    size = next_fast_len(64 * n, real=True)
    peak = np.abs(course(lines, amplitudes, phases, size)).max() / np.cos(np.pi * n / size)
    return float(peak / np.sqrt(0.5 * np.sum(amplitudes**2)))


def phases_of(
    kind: str, lines: IntArray, amplitudes: FloatArray, rng: np.random.Generator, rounds: int = 200
) -> FloatArray:
    """Return the phases of a multisine, rad, shape (F,).

    Parameters
    ----------
    kind : {"random", "schroeder", "low_crest"}
    lines : ndarray of int, shape (F,)
    amplitudes : ndarray, shape (F,)
    rng : numpy.random.Generator
        For the random phases, and the second start of the search for a low crest factor.
    rounds : int
        Of clipping, for each start.
    """
    require_known("choice of phases", "multisine", PHASES, kind)
    random = rng.uniform(0.0, 2.0 * np.pi, lines.size)
    if kind == "random":
        return random
    start = _schroeder(amplitudes)
    if kind == "schroeder":
        return start
    found = []
    for first in (start, random):
        clipped = _clipped(lines, amplitudes, first, rounds)
        found.append(_flattened(lines, amplitudes, clipped))
    return min([start, *found], key=lambda p: crest_factor(lines, amplitudes, p))


def _schroeder(amplitudes: FloatArray) -> FloatArray:
    """M. R. Schroeder, IEEE Trans. Inf. Theory 16 (1970) 85, for any power spectrum."""
    share = amplitudes**2 / np.sum(amplitudes**2)
    before = np.concatenate(([0.0], np.cumsum(share)[:-1]))
    return np.asarray(-2.0 * np.pi * np.concatenate(([0.0], np.cumsum(before)[:-1])))


def _clipped(
    lines: IntArray, amplitudes: FloatArray, phases: FloatArray, rounds: int
) -> FloatArray:
    size = next_fast_len(8 * int(lines.max()), real=True)
    best, least = phases, np.inf
    for i in range(rounds):
        x = course(lines, amplitudes, phases, size)
        peak = float(np.abs(x).max())
        if peak < least:
            best, least = phases, peak
        level = (0.75 + 0.23 * i / rounds) * peak
        phases = np.angle(rfft(np.clip(x, -level, level))[lines])
    return best


def _flattened(lines: IntArray, amplitudes: FloatArray, phases: FloatArray) -> FloatArray:
    """Minimise L_p norms, p = 8 .. 512, by quasi-Newton steps with exact gradients."""
    from scipy.optimize import minimize

    size = next_fast_len(16 * int(lines.max()), real=True)
    scale = float(np.sqrt(0.5 * np.sum(amplitudes**2)))
    best, least = phases, np.inf

    def norm(phi: FloatArray, p: int) -> tuple[float, FloatArray]:
        x = course(lines, amplitudes, phi, size) / scale
        top = np.abs(x).max()
        powers = (np.abs(x) / top) ** (p - 2) * x / top
        mean = float(np.mean(powers * x / top))
        value = top * mean ** (1.0 / p)
        # d value / d x = value / (N mean top) powers;  d x / d phi = -a sin(...)
        inner = rfft(powers)[lines] * np.exp(-1j * phi)
        slope = value / (size * mean * top) * (amplitudes / scale) * inner.imag
        return float(value), np.asarray(slope)

    for p in (8, 16, 32, 64, 128, 256, 512):
        found = minimize(norm, phases, (p,), jac=True, method="L-BFGS-B", options={"maxiter": 60})
        phases = found.x
        peak = float(np.abs(course(lines, amplitudes, phases, size)).max())
        if peak < least:
            best, least = phases, peak
    return best
