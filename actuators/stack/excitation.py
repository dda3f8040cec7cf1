"""Voltages for the identification of a stack: erasing its memory, and the slow loading ramp.

What a decaying oscillation erases follows from the wiping-out property. Let the turning points be
``b + A_0, b - A_1, b + A_2, ..., b`` with ``A_k - A_(k+1) = d``. A play of half width r moves as
long as the swing ``A_k + A_(k+1)`` exceeds 2 r, so afterwards, whatever came before,

    |y_r - b| <= max(min(r, d / 2), r - A_0 + d).

The decay therefore has to begin at ``A_0 >= r_J + d / 2`` around the wanted bias ``b``; the last
term is what a smaller one leaves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from actuators.stack.voltage_limits import P840_1
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput

SAMPLE_RATE = 3125.0
"""Samples per second of the interferometer's block mode in the stack actuator thesis, Hz."""

STEP_OF_SPACING = 0.1
"""Default amplitude step over the smallest distance of two thresholds."""


@dataclass(frozen=True, slots=True, eq=False)
class Excitation:
    """A voltage over time.

    Attributes
    ----------
    time : ndarray, shape (N,), s
        From 0, even.
    volt : ndarray, shape (N,), V
    """

    time: FloatArray
    volt: FloatArray

    @property
    def rate(self) -> float:
        """Samples per second, Hz."""
        return float((self.time.size - 1) / (self.time[-1] - self.time[0]))

    def __repr__(self) -> str:
        """Short text."""
        return (
            f"Excitation({self.time.size} samples, {self.time[-1]:.4g} s, "
            f"{self.volt.min():.4g} .. {self.volt.max():.4g} V)"
        )


def printed_demagnetisation(rate: float = SAMPLE_RATE) -> Excitation:
    """Return ``(20 - 7.5 t) sin(2 pi 1.8 t)`` V for 0 <= t <= 2.67 s.

    Eq. (6.1) of the stack actuator thesis. Its first peaks are +19.0 V and -16.9 V, so plays wider
    than that keep their state: with the operator of its eq. (6.2) the remanence after a stroke to
    100 V falls from 507 nm to no less than 133 nm.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    """
    time = np.arange(math.floor(2.67 * rate) + 1) / rate
    return Excitation(time, (20.0 - 7.5 * time) * np.sin(2 * np.pi * 1.8 * time))


def residual_states(thresholds: ArrayLike, amplitude: float, step: float) -> FloatArray:
    """Return the bound of ``|y_r - b|`` after a decay, shape of `thresholds`.

    Parameters
    ----------
    thresholds : array
        Half widths r of the plays, V.
    amplitude : float
        ``A_0``, V.
    step : float
        ``d = A_k - A_(k+1)`` from one turning point to the next, V.

    Examples
    --------
    >>> residual_states([0.0, 0.1, 10.0, 25.0], amplitude=20.0, step=0.5).tolist()
    [0.0, 0.1, 0.25, 5.5]
    """
    r = np.asarray(thresholds, float)
    return np.asarray(np.maximum(np.minimum(r, 0.5 * step), r - amplitude + step))


def residual_bound(
    thresholds: ArrayLike, weights: ArrayLike, amplitude: float, step: float
) -> float:
    """Return the largest output that a decay can leave: ``sum |w_i|`` times `residual_states`.

    Measured from the output of the same plays resting at the bias (the virgin curve for bias 0).

    Parameters
    ----------
    thresholds, weights : array, shape (n + 1,)
        V and output per V.
    amplitude, step : float
        V.
    """
    return float(np.abs(np.asarray(weights)) @ residual_states(thresholds, amplitude, step))


def possible_biases(
    threshold: float, limits: DriveLimits | None = None
) -> tuple[float, float] | None:
    """Return the biases (V) around which a decay of amplitude `threshold` fits, or None.

    Examples
    --------
    >>> possible_biases(44.0)
    (24.0, 76.0)
    """
    room = limits or P840_1
    low, high = room.low + threshold, room.high - threshold
    return (low, high) if low <= high else None


def demagnetisation(
    thresholds: Sequence[float],
    bias: float,
    *,
    step: float | None = None,
    start: float = 0.0,
    frequency: float = 1.8,
    rate: float = SAMPLE_RATE,
    limits: DriveLimits | None = None,
    partial: bool = False,
) -> Excitation:
    """Return a decay around `bias` that erases plays of all `thresholds`.

    Half waves of a cosine join the turning points, which are samples. What is left is bounded by
    `residual_bound`.

    Parameters
    ----------
    thresholds : sequence of float
        Half widths of the plays, V; the widest sets the amplitude, the smallest spacing the step.
    bias : float
        Where the decay ends, V.
    step : float, optional
        Largest decrease from one turning point to the next, V; default a tenth of the smallest
        spacing.
    start : float
        Voltage before the decay, V.
    frequency : float
        Hz.
    rate : float
        Samples per second, Hz.
    limits : DriveLimits, optional
    partial : bool
        Take the largest amplitude that fits where the widest play cannot be erased.

    Raises
    ------
    UnusableInput
        If the limits leave too little amplitude, or the current is too large.
    """
    room = limits or P840_1
    widths = np.unique(np.asarray(thresholds, float))
    if widths.size == 0 or not np.isfinite(widths).all() or widths[0] < 0 or widths[-1] == 0:
        raise UnusableInput("demagnetisation: thresholds must be finite, >= 0 and not all 0")
    spacing = float(np.diff(widths).min()) if widths.size > 1 else float(widths[0])
    wanted_step = STEP_OF_SPACING * spacing if step is None else float(step)
    if not wanted_step > 0:
        raise UnusableInput(f"demagnetisation: step = {wanted_step} V must be positive")
    amplitude = _amplitude(float(widths[-1]) + 0.5 * wanted_step, bias, room, partial)
    count = math.ceil(amplitude / wanted_step * (1 - 1e-12))
    signs = (-1.0) ** np.arange(count + 1)
    turns = bias + signs * amplitude * (1 - np.arange(count + 1) / count)
    result = _half_waves(np.concatenate(([start], turns)), frequency, rate)
    room.check(result.time, result.volt, "demagnetisation")
    return result


def _amplitude(needed: float, bias: float, room: DriveLimits, partial: bool) -> float:
    fits = min(bias - room.low, room.high - bias)
    if needed <= fits:
        return needed
    if partial and fits > 0:
        return fits
    biases = possible_biases(needed, room)
    where = (
        f"choose a bias of {biases[0]:.4g} .. {biases[1]:.4g} V"
        if biases
        else "no bias has room for it"
    )
    raise UnusableInput(
        f"demagnetisation: around {bias:g} V the limits {room.low:g} .. {room.high:g} V "
        f"leave an amplitude of {max(fits, 0.0):.4g} V, but erasing asks for {needed:.4g} V; "
        f"{where}, or take partial=True and keep the rest of the remanence"
    )


def _half_waves(turns: FloatArray, frequency: float, rate: float) -> Excitation:
    """Join turning points by half waves of equal duration, whole numbers of samples."""
    samples = round(0.5 * rate / frequency) if frequency > 0 else 0
    if samples < 4:
        raise UnusableInput(
            f"demagnetisation: {frequency:g} Hz at {rate:g} samples/s has no 4 samples a half "
            "wave; lower the frequency"
        )
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, samples + 1) / samples)
    body = turns[:-1, None] + np.diff(turns)[:, None] * rise
    volt = np.concatenate((turns[:1], body.ravel()))
    return Excitation(np.arange(volt.size) / rate, volt)


def loading_ramp(
    start: float = 0.0, stop: float = 100.0, duration: float = 10.0, rate: float = SAMPLE_RATE
) -> Excitation:
    """Return the linear rise of the loading curve (stack actuator thesis, section 6.2).

    Parameters
    ----------
    start, stop : float
        V.
    duration : float
        s.
    rate : float
        Samples per second, Hz.
    """
    n = round(duration * rate)
    if n < 1:
        raise UnusableInput(f"loading ramp: {duration:g} s at {rate:g} samples/s has no step")
    return Excitation(np.arange(n + 1) / rate, np.linspace(start, stop, n + 1))


def sine(
    frequency: float,
    duration: float,
    *,
    low: float = 0.0,
    high: float = 100.0,
    rate: float = SAMPLE_RATE,
) -> Excitation:
    """Return ``low + (high - low) (1 - cos(2 pi f t)) / 2`` V."""
    time = np.arange(round(duration * rate) + 1) / rate
    return Excitation(time, low + (high - low) * (0.5 - 0.5 * np.cos(2 * np.pi * frequency * time)))


def join(*parts: Excitation) -> Excitation:
    """Return the parts one after the other; each begins where the one before ended.

    Raises
    ------
    UnusableInput
        If the sampling rates differ or a part begins at another voltage.
    """
    if not parts:
        raise UnusableInput("join: there is no excitation; give at least one")
    rate, volts = parts[0].rate, [parts[0].volt]
    for i, part in enumerate(parts[1:], start=1):
        if abs(part.rate / rate - 1) > 1e-9:
            raise UnusableInput(f"join: part {i} has {part.rate:g} samples/s, not {rate:g}")
        jump = float(part.volt[0] - volts[-1][-1])
        if abs(jump) > 0.1:
            raise UnusableInput(f"join: part {i} begins {jump:.4g} V off; put a ramp in between")
        volts.append(part.volt[1:])
    volt = np.concatenate(volts)
    return Excitation(np.arange(volt.size) / rate, volt)
