"""A delay that changes along a signal known at several points a sample."""

from __future__ import annotations

import numpy as np

from bondgraph.signals.fractional_delay import TAPS, interval_weights, warped
from bondgraph.support.arrays import Array


def warped_within(
    fine: Array, samples: Array, m: int, *, resting: bool = True
) -> tuple[Array, Array]:
    """``y(n - samples[n])`` along the first axis, and its derivative by the delay.

    As `bondgraph.signals.fractional_delay.delayed_within`, with a delay of its own at every sample:
    interpolation stays within one sample interval, so that kinks at the samples stay sharp. Beyond
    its end the signal goes on as the parabola through its last three samples.

    Parameters
    ----------
    fine : ndarray, shape ((N - 1) * m + 1, ...)
    samples : ndarray, shape (N,)
        Delays in samples, any sign.
    m : int
        Points a sample.
    resting : bool
        Before its first sample the signal rests; otherwise it is extrapolated there too.

    Returns
    -------
    value, slope : ndarray, shape (N, ...)
    """
    n = (fine.shape[0] - 1) // m + 1
    whole = np.ceil(samples).astype(int)
    first, weights, slopes = interval_weights(whole - samples, m)
    before = 0 if resting else max(int(whole.max(initial=0)), 0)
    after = max(1 - int(whole.min(initial=0)), 0)
    fine = _continued(fine, m, before, after)
    start = (np.arange(n) - whole + before) * m + first
    value = np.zeros((n, *fine.shape[1:]))
    slope = np.zeros_like(value)
    shape = (n, *(1,) * (fine.ndim - 1))
    for j in range(weights.shape[1]):
        part = fine[np.clip(start + j, 0, fine.shape[0] - 1)]
        value += weights[:, j].reshape(shape) * part
        slope -= slopes[:, j].reshape(shape) * part
    return value, slope


def at_clock(y: Array, ratio: float) -> Array:
    """Return a signal at the times ``(1 + ratio) n`` of a clock that runs at another rate.

    A fast clock looks past the end, where the signal goes on as a parabola.

    Parameters
    ----------
    y : ndarray, shape (N,)
    ratio : float
        Ratio error of the clock.

    Examples
    --------
    >>> round(float(at_clock(np.arange(100.0), 0.01)[50]), 9)
    50.5
    """
    n = y.shape[0]
    longer = _continued(np.asarray(y, float), 1, 0, TAPS + max(0, int(np.ceil(ratio * n))))
    return np.asarray(warped(longer[:, None], -ratio * np.arange(longer.shape[0]))[0][:n, 0])


def _continued(fine: Array, m: int, before: int, after: int) -> Array:
    """Return a signal with some samples added at its ends, on parabolas through three samples.

    Parameters
    ----------
    fine : ndarray, shape ((N - 1) * m + 1, ...)
    m : int
        Points a sample.
    before, after : int
        Samples to add. A signal of fewer than three samples rests at its ends.
    """
    if fine.shape[0] < 2 * m + 1:
        return np.pad(fine, [(before * m, after * m), *[(0, 0)] * (fine.ndim - 1)], mode="edge")
    pieces = [_parabola(fine[2 * m :: -m], m, before)[::-1], fine]
    return np.concatenate([*pieces, _parabola(fine[-1 - 2 * m :: m], m, after)])


def _parabola(three: Array, m: int, count: int) -> Array:
    """Values `count` samples on from the last of three, `m` points a sample."""
    t = np.arange(1, count * m + 1).reshape(-1, *(1,) * (three.ndim - 1)) / m
    a, b, c = three
    return np.asarray(c + t * (1.5 * c - 2 * b + 0.5 * a) + 0.5 * t * t * (a - 2 * b + c))
