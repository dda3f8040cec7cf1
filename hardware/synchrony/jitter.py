"""Scatter of single sampling instants: noise that grows with the slope."""

from __future__ import annotations

import math

import numpy as np

from bondgraph.support.arrays import FloatArray as Array

ROUNDS = 3


def jitter_of(rest: Array, slope: Array) -> tuple[float, float]:
    """Return the jitter (s, standard deviation) and its standard error.

    ``rest^2 = noise^2 + jitter^2 slope^2`` by least squares, weighted by the fourth moment of a
    normal distribution.

    Parameters
    ----------
    rest : ndarray
        (n,), what is left of a fit.
    slope : ndarray
        (n,), of the fitted signal in time, in the unit of `rest` per s.

    Returns
    -------
    tuple of float
        NaN if the slope does not vary enough to tell jitter from noise.
    """
    power = slope**2
    top = float(power.max(initial=0.0))
    if rest.size < 64 or not top > 0.0:
        return math.nan, math.nan
    a = np.column_stack([np.ones(rest.size), power / top])
    if float(np.std(a[:, 1])) < 1e-3:
        return math.nan, math.nan
    y = rest**2
    expected = np.full(rest.size, float(y.mean()) + 1e-300)
    for _ in range(ROUNDS):
        w = 1.0 / expected
        c, *_ = np.linalg.lstsq(a * w[:, None], y * w, rcond=None)
        expected = np.maximum(a @ np.maximum(c, 0.0), 1e-3 * float(y.mean()) + 1e-300)
    spread = np.linalg.inv((a / expected[:, None]).T @ (a / expected[:, None])) * 2.0
    variance, error = float(c[1]) / top, math.sqrt(float(spread[1, 1])) / top
    jitter = math.sqrt(max(variance, 0.0))
    # at zero the variance, not the jitter, has a normal error
    return jitter, error / (2.0 * max(jitter, math.sqrt(error / 2.0)))
