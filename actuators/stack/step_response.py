"""Damping and stiffness of a stack from its ringing after a step of the voltage."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuators.stack.loading_curve import Interval
from actuators.stack.ramps import channel_in
from bondgraph.hysteresis.fitting.numbered import intervals, lowered
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray


@dataclass(frozen=True, slots=True)
class Ringing:
    """``x = a + b t + exp(-s t) (c cos w t + d sin w t)`` after a step.

    Attributes
    ----------
    decay, pulsation : Interval
        s (1/s) and w (rad/s).
    rms : float
        Of the misfit, m.
    """

    decay: Interval
    pulsation: Interval
    rms: float

    def stiffness(self, mass: float) -> Interval:
        """Return ``m (w^2 + s^2)``, N/m: short circuit where R_e C is small against a period."""
        w, s = self.pulsation, self.decay
        error = 2.0 * mass * math.hypot(w.value * w.error, s.value * s.error)
        return Interval.of(mass * (w.value**2 + s.value**2), error)

    def damping(self, mass: float) -> Interval:
        """Return ``b = 2 m s``, N s/m; what a resistance in the lead takes is part of it."""
        return Interval.of(2.0 * mass * self.decay.value, 2.0 * mass * self.decay.error)


def fit_step(recording: Recording) -> Ringing:
    """Fit the ringing after the largest step of a recording.

    Parameters
    ----------
    recording : Recording
        At least eight samples a period, and a few periods behind the step.

    Raises
    ------
    UnusableInput
        If there is no step, or nothing rings behind it.

    Examples
    --------
    >>> t = np.arange(400) * 1e-5
    >>> v = np.where(t < 2e-4, 0.0, 1.0)
    >>> x = v * 1e-8 * (1 - np.exp(-900 * (t - 2e-4)) * np.cos(3e4 * (t - 2e-4)))
    >>> r = Recording("step", t, {"V": v, "x": x}, {"V": "V", "x": "m"})
    >>> round(fit_step(r).decay.value, 3), round(fit_step(r).pulsation.value, 3)
    (900.0, 30000.0)
    """
    u, x = channel_in(recording, "V"), channel_in(recording, "m")
    jumps = np.abs(np.diff(u))
    at = int(np.argmax(jumps)) + 1
    if not jumps[at - 1] >= 0.5 * np.ptp(u) or np.ptp(u) == 0.0:
        raise UnusableInput(
            f"{recording.name}: the voltage makes no step from one sample to the next; damping "
            "needs one"
        )
    t, y = recording.time[at:] - recording.time[at], x[at:]
    if y.size < 32:
        raise UnusableInput(f"{recording.name}: {y.size} samples behind the step; record more")
    tail = y - np.median(y[y.size // 2 :])
    spectrum = np.abs(np.fft.rfft(tail * np.exp(-4.0 * np.arange(y.size) / y.size)))
    line = int(np.argmax(spectrum[2:])) + 2
    w = 2.0 * np.pi * line / (y.size * float(t[1] - t[0]))
    if w * (t[1] - t[0]) > 2.0 * np.pi / 6.0:
        raise UnusableInput(
            f"{recording.name}: rings with {w / (2 * np.pi):.4g} Hz, sampled at "
            f"{recording.fs:.4g} Hz; take at least eight samples a period"
        )
    # the charging of the stack is over by then
    later = t >= 0.5 * np.pi / w
    t, y = t[later] - t[later][0], y[later]
    size = float(np.ptp(y))
    point = None
    for ratio in (0.01, 0.05, 0.2):
        columns = _columns(t, ratio * w, w)
        linear, *_ = np.linalg.lstsq(columns, y, rcond=None)
        found = lowered(lambda p: _misfit(t, y, p, w), np.array([*linear, ratio, 1.0]))
        if found is not None and (point is None or found.cost < point.cost):
            point = found
    nothing = UnusableInput(f"{recording.name}: nothing rings behind the step; take a smaller mass")
    if point is None or not point.cost < 0.2 * size or not point.numbers[4] > 0.0:
        raise nothing
    found_numbers = intervals(point, _NAMES)[4:]
    told = [_times(n.value, n.ci95, w) for n in found_numbers if n.ci95 is not None]
    if len(told) < 2:
        raise nothing
    decay, pulsation = told
    return Ringing(decay, pulsation, point.cost)


_NAMES = ("a", "b", "c", "d", "s", "w")


def _times(value: float, ci95: tuple[float, float], w: float) -> Interval:
    return Interval(value * w, (ci95[0] * w, ci95[1] * w))


def _columns(t: FloatArray, s: float, w: float) -> FloatArray:
    e = np.exp(-s * t)
    return np.column_stack((np.ones_like(t), t, e * np.cos(w * t), e * np.sin(w * t)))


def _misfit(
    t: FloatArray, y: FloatArray, p: FloatArray, w: float
) -> tuple[FloatArray, FloatArray] | None:
    s, v = p[4] * w, p[5] * w
    if not (0.0 < p[4] < 1.0 and 0.5 < p[5] < 2.0):
        return None
    columns = _columns(t, s, v)
    swing, turned = columns[:, 2:] @ p[2:4], columns[:, 2:] @ np.array([p[3], -p[2]])
    return columns @ p[:4] - y, np.column_stack((columns, -w * t * swing, w * t * turned))
