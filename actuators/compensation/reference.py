"""The reference of the stack actuator thesis (eq. 7.3), and a smoother one to compare with."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from actuators.compensation.motion import AnalyticMotion, constant, product, sine, smooth_step
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

FIRST, SECOND, OFFSET = 2000e-9, 1500e-9, 2500e-9
"""Amplitudes before and after half a period, and the mean after it, m."""


def thesis_reference(time: ArrayLike, frequency: float = 1.0) -> AnalyticMotion:
    """Return the reference ``x_ref`` of eq. (7.3) with analytic derivatives.

    ``2000 nm (1 - cos w t)`` for half a period, then ``2500 nm - 1500 nm cos w t``; rest before
    t = 0. Position and velocity are continuous. The acceleration jumps at t = 0 and after half a
    period (`acceleration_jumps`), so an inverse that needs it steps there; at these instants the
    right-hand values are given. The jerk leaves out the impulses of the jumps.

    Parameters
    ----------
    time : array, shape (N,), s
    frequency : float
        Hz; 1 in the thesis. The switch comes after half a period.

    Returns
    -------
    AnalyticMotion

    Raises
    ------
    UnusableInput
        If the times are not a finite record or the frequency is not positive.

    Examples
    --------
    >>> thesis_reference([0.0, 0.5, 1.0]).x.round(12).tolist()
    [0.0, 4e-06, 1e-06]
    """
    t, omega = _checked(time, frequency)
    minus_cosine = sine(omega, -0.5 * math.pi, t)
    first = FIRST * (minus_cosine + constant(1.0, t))
    second = SECOND * minus_cosine + constant(OFFSET, t)
    jet = np.where(t < 0.5 / frequency, first, second)
    return _motion(t, np.where(t < 0.0, 0.0, jet))


def smooth_reference(time: ArrayLike, frequency: float = 1.0) -> AnalyticMotion:
    """Return a relative of `thesis_reference` with a continuous third derivative.

    The start is faded in over the first quarter of a period, and amplitude and mean are exchanged
    gradually around half a period, over a fifth of one. Both references agree from 0.6 periods on.

    Times and frequency are as in `thesis_reference`, and so is what is refused.

    Examples
    --------
    >>> smooth_reference([0.0, 0.5, 1.0]).x.round(12).tolist()
    [0.0, 4e-06, 1e-06]
    """
    t, omega = _checked(time, frequency)
    rise = sine(omega, -0.5 * math.pi, t) + constant(1.0, t)
    exchange = smooth_step(0.4 / frequency, 0.2 / frequency, t)
    amplitude = constant(FIRST, t) + (SECOND - FIRST) * exchange
    base = product(amplitude, rise) + (OFFSET - SECOND) * exchange
    return _motion(t, product(smooth_step(0.0, 0.25 / frequency, t), base))


def acceleration_jumps(frequency: float = 1.0) -> tuple[tuple[float, float], ...]:
    """Return instants (s) and heights (m/s2) of the jumps in `thesis_reference`'s acceleration.

    Examples
    --------
    >>> [(t, round(1e9 * a)) for t, a in acceleration_jumps()]
    [(0.0, 78957), (0.5, 19739)]
    """
    square = (2.0 * math.pi * frequency) ** 2
    return (0.0, FIRST * square), (0.5 / frequency, (FIRST - SECOND) * square)


def _checked(time: ArrayLike, frequency: float) -> tuple[FloatArray, float]:
    t = np.asarray(time, dtype=float)
    if t.ndim != 1 or not t.size or not np.isfinite(t).all():
        raise UnusableInput("reference: time must be a finite record of at least one sample")
    if not (math.isfinite(frequency) and frequency > 0.0):
        raise UnusableInput(f"reference: frequency {frequency} Hz must be positive")
    return t, 2.0 * math.pi * frequency


def _motion(t: FloatArray, jet: FloatArray) -> AnalyticMotion:
    return AnalyticMotion(t, jet[0], jet[1], jet[2], jet[3])
