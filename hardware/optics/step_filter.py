"""Linear filters that see a step at one sample and are blind to smooth motion.

A step between two samples is estimated by least squares together with a polynomial through the
samples around it; for even sampling that is one fixed filter.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bondgraph.support.arrays import FloatArray as Array

HALF = 6
"""Samples on either side of the step."""
ORDER = 3
"""Order of the polynomial: motion up to its constant jerk leaves no trace."""


@lru_cache(maxsize=256)
def _weights(left: int, right: int, order: int) -> tuple[float, ...]:
    place = np.arange(-left, right) + 0.5
    place = place / (left + right)
    columns = np.concatenate(
        [place[:, None] ** np.arange(order + 1), (place > 0.0)[:, None].astype(np.float64)], axis=1
    )
    return tuple(np.linalg.pinv(columns)[-1].tolist())


def step_filter(left: int = HALF, right: int = HALF, order: int = ORDER) -> Array:
    """Weights of the samples around a step, in order of time.

    Parameters
    ----------
    left, right : int
        Samples before and from the step on; together two more than `order`.
    order : int
        Of the polynomial.

    Returns
    -------
    ndarray
        ``(left + right,)``; their scalar product with the samples is the step.
    """
    return np.array(_weights(left, right, order))


def step_estimates(position: Array) -> Array:
    """Least-squares step in front of every sample.

    Parameters
    ----------
    position : ndarray
        ``(n,)``, n at least ``2 HALF``.

    Returns
    -------
    ndarray
        ``(n,)``; at the ends with the samples there are. The first is 0: nothing is before it.
    """
    n = position.size
    J = np.zeros(n)
    inner = np.convolve(position, step_filter()[::-1], mode="valid")
    J[HALF : n - HALF + 1] = inner
    for k in range(1, HALF):
        J[k] = step_filter(k, HALF) @ position[: k + HALF]
        J[n - k] = step_filter(HALF, k) @ position[n - k - HALF :]
    return J


def robust_spread(values: Array) -> float:
    """Return the standard deviation of normal values by their median size, deaf to some jumps."""
    return 1.4826 * float(np.median(np.abs(values)))


def step_spreads(position: Array) -> Array:
    """Robust standard deviation of every estimate of `step_estimates`, ``(n,)``.

    The shorter filters at the ends let more noise and motion through; how much is found by running
    each of them over the whole record.
    """
    n = position.size

    def spread(left: int, right: int) -> float:
        weights = step_filter(left, right)[::-1]
        return robust_spread(np.convolve(position, weights, mode="valid"))

    spreads = np.full(n, spread(HALF, HALF))
    for k in range(1, HALF):
        spreads[k], spreads[n - k] = spread(k, HALF), spread(HALF, k)
    return spreads


def motion_leak(frequency: float, rate: float) -> float:
    """How much of a sine's amplitude the filter takes for a step.

    Parameters
    ----------
    frequency : float
        Of the motion (Hz).
    rate : float
        Of the samples (Hz).

    Returns
    -------
    float
        Step seen by amplitude moved; the largest over the phase.
    """
    place = np.arange(-HALF, HALF) + 0.5
    wave = np.exp(2j * np.pi * frequency / rate * place)
    return float(abs(np.dot(step_filter(), wave)))
