"""A motion with its derivatives, and the calculus that keeps them analytic.

A jet is an array of shape (4, N): a signal and its first three derivatives at N instants.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from bondgraph.support.ops import FloatArray

ORDERS = 4


@dataclass(frozen=True, slots=True)
class AnalyticMotion:
    """A displacement and its analytic derivatives.

    Attributes
    ----------
    time : ndarray, shape (N,), s
    x, v, a, j : ndarray, shape (N,)
        Displacement (m), velocity (m/s), acceleration (m/s2), jerk (m/s3).
    """

    time: FloatArray
    x: FloatArray
    v: FloatArray
    a: FloatArray
    j: FloatArray


def constant(value: float, time: FloatArray) -> FloatArray:
    """Return the jet of a constant."""
    jet = np.zeros((ORDERS, time.size))
    jet[0] = value
    return jet


def sine(omega: float, phase: float, time: FloatArray) -> FloatArray:
    """Return the jet of ``sin(omega t + phase)``; omega in rad/s, phase in rad."""
    turns = 0.5 * np.pi * np.arange(ORDERS)[:, None]
    return np.asarray(
        omega ** np.arange(ORDERS)[:, None] * np.sin(omega * time + phase + turns), dtype=float
    )


def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the jet of a product by the rule of Leibniz.

    Examples
    --------
    >>> t = np.array([2.0])
    >>> square = product(ramp(0.0, 1.0, t), ramp(0.0, 1.0, t))
    >>> square[:, 0].tolist()
    [4.0, 4.0, 2.0, 0.0]
    """
    rows = [sum(comb(n, k) * a[k] * b[n - k] for k in range(n + 1)) for n in range(ORDERS)]
    return np.asarray(rows, dtype=float)


def ramp(start: float, width: float, time: FloatArray) -> FloatArray:
    """Return the jet of ``(t - start) / width``."""
    jet = np.zeros((ORDERS, time.size))
    jet[0] = (time - start) / width
    jet[1] = 1.0 / width
    return jet


def smooth_step(start: float, width: float, time: FloatArray) -> FloatArray:
    """Return the jet of a step from 0 to 1 within `width` s whose third derivative is continuous.

    ``35 s^4 - 84 s^5 + 70 s^6 - 20 s^7``, the polynomial of least degree that leaves and arrives
    with three vanishing derivatives.

    Examples
    --------
    >>> smooth_step(0.0, 1.0, np.array([0.0, 0.5, 1.0]))[0].tolist()
    [0.0, 0.5, 1.0]
    """
    s = np.clip((time - start) / width, 0.0, 1.0)
    polynomial = np.polynomial.Polynomial([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0])
    return np.asarray([polynomial.deriv(n)(s) / width**n for n in range(ORDERS)], dtype=float)
