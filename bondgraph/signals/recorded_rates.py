"""The rate of an input that is recorded by its integral: a base by its displacement.

The motion is the cubic spline through the samples. Within a sub-step of length h its rate runs
straight, changes as the spline's does and makes exactly the spline's way: a parabola. Beside the
spline the way is off by ``h^3 / 125`` of its third derivative at most, the rate by ``h^2 / 12``.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from bondgraph.support.arrays import Array

LEAST = 4
"""Samples that a spline needs."""


def slopes(values: Array, step: float, breaks: Sequence[int] = ()) -> Array:
    """Return the slopes of the spline through samples `step` (s) apart, shape (N,).

    Parameters
    ----------
    values : ndarray, shape (N,)
    breaks : sequence of int
        Samples at which another recording begins.

    Examples
    --------
    >>> slopes(np.arange(6.0) ** 2, 1.0).round(9)
    array([ 0.,  2.,  4.,  6.,  8., 10.])
    """
    from scipy.interpolate import CubicSpline

    found = np.zeros(len(values))
    for a, b in pairwise((0, *breaks, len(values))):
        part = np.asarray(values[a:b], float)
        if part.size >= LEAST:
            found[a:b] = CubicSpline(np.arange(part.size), part)(np.arange(part.size), 1) / step
        elif part.size > 1:
            found[a:b] = np.gradient(part, step)
    return found


def with_rates(
    names: Sequence[str], rates: Sequence[str], u: Array, fine: Array, step: float
) -> tuple[Array, Array]:
    """Return inputs whose `rates` run through each step as the module says.

    Parameters
    ----------
    names : sequence of str
        Of all inputs.
    rates : sequence of str
        Those of them, ``d_NAME``, that are rates of recorded integrals; the slopes at the samples.
    u : ndarray, shape (N, n_u)
        At the samples.
    fine : ndarray, shape ((N - 1) * n_sub, 2, n_u)
        At both ends of each sub-step.
    """
    if not rates or not fine.shape[0]:
        return u, fine
    u, fine = u.copy(), fine.copy()
    n_sub = fine.shape[0] // (u.shape[0] - 1)
    x = np.arange(n_sub + 1) / n_sub
    for name in rates:
        at, way = names.index(name), u[:, names.index(name.partition("_")[2])]
        mean, first, last = (v[:, None] for v in (np.diff(way) / step, u[:-1, at], u[1:, at]))
        # the way of the cubic from the first sample on, over the step
        gone = x * ((1 - x) ** 2 * first - x * (1 - x) * last + x * (3 - 2 * x) * mean)
        straight, turn = np.diff(gone) * n_sub, np.diff(slope_within(x, mean, first, last))
        fine[:, 0, at] = (straight - turn / 2).ravel()
        fine[:, 1, at] = (straight + turn / 2).ravel()
        u[0, at] = fine[0, 0, at]
    return u, fine


def slope_within(x: Array, mean: Array, first: Array, last: Array) -> Array:
    """Return the slope of the cubic at the part `x` of a step, by its mean and those at the ends.

    Examples
    --------
    >>> slope_within(np.array([0.0, 0.5, 1.0]), 1.0, 0.0, 3.0)
    array([0.  , 0.75, 3.  ])
    """
    return np.asarray(
        (1 - x) * (1 - 3 * x) * first + x * (3 * x - 2) * last + 6 * x * (1 - x) * mean
    )
