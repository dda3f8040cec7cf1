"""A delay that changes along a signal known at several points a sample."""

from __future__ import annotations

import numpy as np

__all__ = ["warped_within"]

Array = np.ndarray


def warped_within(fine: Array, samples: Array, m: int) -> tuple[Array, Array]:
    """``y(n - samples[n])`` along the first axis, and its derivative by the delay.

    As `bondgraph.shift.delayed_within`, with a delay of its own at every sample: interpolation
    stays within one sample interval, so that kinks at the samples stay sharp. Beyond its ends the
    signal rests.

    Parameters
    ----------
    fine : ndarray, shape ((N - 1) * m + 1, ...)
    samples : ndarray, shape (N,)
        Delays in samples, any sign.
    m : int
        Points a sample.

    Returns
    -------
    value, slope : ndarray, shape (N, ...)
    """
    n = (fine.shape[0] - 1) // m + 1
    whole = np.ceil(samples).astype(int)
    weights, slopes = _weights(whole - samples, m)
    start = (np.arange(n) - whole) * m
    value = np.zeros((n, *fine.shape[1:]))
    slope = np.zeros_like(value)
    shape = (n, *(1,) * (fine.ndim - 1))
    for j in range(m + 1):
        part = fine[np.clip(start + j, 0, fine.shape[0] - 1)]
        value += weights[:, j].reshape(shape) * part
        slope -= slopes[:, j].reshape(shape) * part
    return value, slope


def _weights(fraction: Array, m: int) -> tuple[Array, Array]:
    """Lagrange weights at fractions of an interval with nodes ``0, 1/m, ..., 1``, and slopes."""
    nodes = np.arange(m + 1) / m
    columns, changes = [], []
    for i, a in enumerate(nodes):
        others = np.delete(nodes, i)
        polynomial = np.polynomial.polynomial.polyfromroots(others) / np.prod(a - others)
        columns.append(np.polynomial.polynomial.polyval(fraction, polynomial))
        derivative = np.polynomial.polynomial.polyder(polynomial)
        changes.append(np.polynomial.polynomial.polyval(fraction, derivative))
    return np.stack(columns, axis=1), np.stack(changes, axis=1)
