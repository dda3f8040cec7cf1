"""Noise of the readings from the residuals of a fit: white, or autoregressive by order."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_toeplitz

__all__ = ["autoregressive", "innovations"]

Array = np.ndarray
LARGEST_ORDER = 20


def autoregressive(residual: Array, largest: int = LARGEST_ORDER) -> Array:
    """Return the polynomial ``1, a_1, ..., a_p`` that whitens a record of residuals.

    Yule-Walker equations (always stable), the order by BIC.

    Parameters
    ----------
    residual : ndarray, shape (N,)
        In time order; its mean is removed.
    largest : int
        Largest order that is tried.

    Returns
    -------
    ndarray, shape (p + 1,)
    """
    e = residual - residual.mean()
    n = e.size
    most = max(0, min(largest, n // 10))
    spectrum = np.fft.rfft(e, 2 * n)
    r = np.fft.irfft(np.abs(spectrum) ** 2)[: most + 1] / n
    if not r[0] > 0:
        return np.ones(1)
    best, chosen = n * np.log(r[0]), np.ones(1)
    for p in range(1, most + 1):
        a = -solve_toeplitz(r[:p], r[1 : p + 1])
        power = float(r[0] + a @ r[1 : p + 1])
        if power <= 0:
            break
        score = n * np.log(power) + p * np.log(n)
        if score < best:
            best, chosen = score, np.concatenate([[1.0], a])
    return chosen


def innovations(residual: Array, polynomial: Array) -> Array:
    """Return the residual after its whitening filter, without the run-in, shape (N - p,)."""
    return np.asarray(np.convolve(residual, polynomial, mode="valid"))
