"""Fractional delay of sampled signals, with its derivative by the delay."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from bondgraph.support.arrays import Array

TAPS = 8


@lru_cache(maxsize=8)
def _coefficients(first: int, last: int) -> Array:
    """Coefficients of the Lagrange polynomials through some whole numbers, powers rising."""
    nodes = np.arange(first, last + 1.0)
    rows = []
    for i, a in enumerate(nodes):
        others = np.delete(nodes, i)
        rows.append(np.polynomial.polynomial.polyfromroots(others) / np.prod(a - others))
    return np.array(rows)


@lru_cache(maxsize=64)
def lagrange(fraction: float) -> tuple[Array, Array]:
    """Eight-point Lagrange weights for a delay of `fraction` in [0, 1) samples, and derivatives.

    The weights apply to samples ``n + 3, ..., n - 4`` in that order, so the interpolation is
    centred; Laakso et al., IEEE Signal Processing Magazine 13 (1996) 30.
    """
    c, k = _coefficients(-3, 4), np.arange(TAPS)
    return c @ fraction**k, c[:, 1:] @ (k[1:] * fraction ** k[:-1])


def delayed(y: Array, samples: float) -> tuple[Array, Array]:
    """``y(n - samples)`` along the first axis, and its derivative by `samples`.

    Before the first sample the signal is taken to rest at its first value.

    Parameters
    ----------
    y : ndarray, shape (N, ...)
    samples : float
        Delay in samples, any sign.
    """
    weights, slopes = lagrange(samples - np.floor(samples))
    return _mixed(y, samples, weights), _mixed(y, samples, slopes)


def delayed_values(y: Array, samples: float) -> Array:
    """``y(n - samples)`` along the first axis, as `delayed`, without its derivative."""
    return _mixed(y, samples, lagrange(samples - np.floor(samples))[0])


def _mixed(y: Array, samples: float, weights: Array) -> Array:
    """Sum of shifted copies; beyond its ends the signal rests."""
    whole, n = int(np.floor(samples)), y.shape[0]
    reach = min(abs(whole) + TAPS // 2, n)
    y = np.asarray(y, float)
    padded = np.empty((n + 2 * reach, *y.shape[1:]))
    padded[:reach], padded[reach : reach + n], padded[reach + n :] = y[0], y, y[-1]
    begins = [min(max(reach - whole - node, 0), 2 * reach) for node in range(-3, 5)]
    rows = max(CACHED // max(math.prod(y.shape[1:]), 1), 1)
    value, work = np.zeros(y.shape), np.empty((min(rows, n), *y.shape[1:]))
    for a in range(0, n, rows):
        here = value[a : a + rows]
        part = work[: here.shape[0]]
        for weight, begin in zip(weights, begins, strict=True):
            if not weight:
                continue  # a whole number of samples
            np.multiply(padded[begin + a : begin + a + here.shape[0]], weight, out=part)
            here += part
    return value


CACHED = 1 << 15
"""Numbers that a stretch of a sum holds: they stay in the cache."""


def warped(y: Array, samples: Array) -> tuple[Array, Array]:
    """``y(n - samples[n])`` along the first axis, and its derivative by the delay.

    Eight-point Lagrange interpolation with a delay of its own at every sample; beyond its ends the
    signal rests at its end values.

    Parameters
    ----------
    y : ndarray, shape (N, k)
    samples : ndarray, shape (N,)
        Delays in samples, any sign.
    """
    n = y.shape[0]
    whole = np.floor(samples).astype(int)
    powers = (samples - whole)[:, None] ** np.arange(TAPS)
    c, k = _coefficients(-3, 4), np.arange(TAPS)
    weights, changes = powers @ c.T, powers[:, :-1] @ (c[:, 1:] * k[1:]).T
    index = np.arange(n) - whole
    value, slope = np.zeros_like(y, dtype=float), np.zeros_like(y, dtype=float)
    for i, node in enumerate(range(-3, 5)):
        part = y[np.clip(index - node, 0, n - 1)]
        value += weights[:, i, None] * part
        slope += changes[:, i, None] * part
    return value, slope


DEGREE = 4
"""Of the polynomial within a sample: one through many points follows no kink between them."""


def interval_weights(fraction: Array, m: int) -> tuple[Array, Array, Array]:
    """Lagrange weights within an interval with nodes ``0, 1/m, ..., 1``, and their derivatives.

    Parameters
    ----------
    fraction : ndarray, shape (...,)
        Of the interval, from 0 to 1.
    m : int
        Points a sample.

    Returns
    -------
    first : ndarray of int, shape (...,)
        Node that the first weight applies to; the others follow it.
    weights, slopes : ndarray, shape (..., k + 1)
        `k` is `DEGREE`, or `m` if that is less.
    """
    k = min(m, DEGREE)
    at = m * np.asarray(fraction, float)
    first = np.clip(np.floor(at - 0.5 * (k - 1)), 0, m - k).astype(int)
    c, power = _coefficients(0, k), np.arange(k + 1)
    powers = (at - first)[..., None] ** power
    return first, powers @ c.T, m * (powers[..., :-1] @ (c[:, 1:] * power[1:]).T)


def delayed_within(fine: Array, samples: float, m: int) -> tuple[Array, Array]:
    """Delay of a signal known at `m` points a sample, and its derivative by the delay.

    Interpolates within one sample interval only, so that the kinks which a command makes at the
    samples (current behind a resistor) stay sharp.

    Parameters
    ----------
    fine : ndarray, shape ((N - 1) * m + 1, ...)
    samples : float
        Delay in samples, not negative.

    Returns
    -------
    value, slope : ndarray, shape (N, ...)
    """
    n = (fine.shape[0] - 1) // m + 1
    whole = int(np.ceil(samples))
    first, weights, slopes = interval_weights(np.asarray(whole - samples), m)
    start = (np.arange(n) - whole) * m + first
    value = np.zeros((n, *fine.shape[1:]))
    slope = np.zeros_like(value)
    for j in range(weights.size):
        part = fine[np.clip(start + j, 0, fine.shape[0] - 1)]
        value += weights[j] * part
        slope -= slopes[j] * part
    return value, slope
