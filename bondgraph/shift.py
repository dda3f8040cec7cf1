"""Fractional delay of sampled signals, with its derivative by the delay."""

from __future__ import annotations

import numpy as np

Array = np.ndarray
TAPS = 8


def lagrange(fraction: float) -> tuple[Array, Array]:
    """Eight-point Lagrange weights for a delay of `fraction` in [0, 1) samples, and derivatives.

    The weights apply to samples ``n + 3, ..., n - 4`` in that order, so the interpolation is
    centred; Laakso et al., IEEE Signal Processing Magazine 13 (1996) 30.
    """
    nodes = np.arange(-3.0, 5.0)
    weights, slopes = np.empty(TAPS), np.empty(TAPS)
    for i, a in enumerate(nodes):
        others = np.delete(nodes, i)
        scale = np.prod(a - others)
        factors = fraction - others
        weights[i] = np.prod(factors) / scale
        slopes[i] = sum(np.prod(np.delete(factors, j)) for j in range(TAPS - 1)) / scale
    return weights, slopes


def delayed(y: Array, samples: float) -> tuple[Array, Array]:
    """``y(n - samples)`` along the first axis, and its derivative by `samples`.

    Before the first sample the signal is taken to rest at its first value.

    Parameters
    ----------
    y : ndarray, shape (N, ...)
    samples : float
        Delay in samples, any sign.
    """
    whole = int(np.floor(samples))
    weights, slopes = lagrange(samples - whole)
    n = y.shape[0]
    index = np.arange(n)
    value, slope = np.zeros_like(y, dtype=float), np.zeros_like(y, dtype=float)
    for k, node in enumerate(range(-3, 5)):
        part = y[np.clip(index - whole - node, 0, n - 1)]
        value += weights[k] * part
        slope += slopes[k] * part
    return value, slope
