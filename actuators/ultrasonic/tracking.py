"""Resonance tracking by a phase-locked loop, as the stack actuator thesis proposes (chapter 9).

Baseband model: the complex amplitude of the vibration's current about the drive frequency, the
temperature of the plate, the loop's frequency. The carrier of 215 kHz is averaged out; minutes of
heating run in one compiled call.

    di/dt = -(beta + j delta) i + beta V / R        delta = omega_drive - omega_r(theta)
    C_th dtheta/dt = V Re(i) / 2 - theta / R_th     omega_r = omega_0 (1 + alpha theta)
    omega_drive = omega_start + K_p e + K_i int e   e = Im(I) / |I|,  I = i + j omega C_rest V

The last line is the loop: the current lags when the drive is too fast. ``C_rest`` is what remains
of ``C_0`` after its current has been subtracted.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from math import exp, inf, pi, sqrt
from typing import Any

import numpy as np

from actuators.ultrasonic.characteristic import force
from actuators.ultrasonic.data_sheet import M661
from actuators.ultrasonic.plate import Plate
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True)
class Heating:
    """How the plate warms and what that does to its resonance; all three are assumptions.

    Parameters
    ----------
    resistance : float
        To the surroundings, K/W; 30 K at the printed 5 W.
    time_constant : float
        s.
    coefficient : float
        Relative change of the resonance per kelvin, 1/K.
    """

    resistance: float = 6.0
    time_constant: float = 15.0
    coefficient: float = -150e-6

    def __post_init__(self) -> None:
        """Refuse times that run backwards."""
        if not (self.time_constant > 0 and self.resistance >= 0):
            raise UnusableInput(f"Heating: time constant > 0, resistance >= 0, not {self}")


@dataclass(frozen=True)
class PhaseLock:
    """The loop that keeps voltage and current in phase.

    Parameters
    ----------
    bandwidth : float
        Hz; of the locked loop, far below the half width of the resonance.
    span : float
        The oscillator reaches the start frequency plus or minus this, Hz; an assumption.
    compensation : float
        Share of the current of ``C_0`` that is subtracted before the phase is compared.
    proportional : float
        Share of the half width by which a full phase error moves the frequency at once.
    """

    bandwidth: float = 5.0
    span: float = 10e3
    compensation: float = 1.0
    proportional: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a loop that cannot act."""
        if not (self.bandwidth > 0 and self.span > 0 and self.proportional >= 0):
            raise UnusableInput(f"PhaseLock: bandwidth and span have to be > 0, not {self}")


@dataclass(frozen=True)
class Tracked:
    """A run of the plate.

    Attributes
    ----------
    time : ndarray, shape (N,), s
    amplitude : ndarray, shape (N,)
        Vibration as a share of that at resonance, 0 to 1.
    phase : ndarray, shape (N,), rad
        Of the vibration's current against the voltage.
    detuning : ndarray, shape (N,), Hz
        Drive frequency less resonance.
    warming : ndarray, shape (N,), K
    power : ndarray, shape (N,), W
    """

    control: float
    time: Array = field(repr=False)
    amplitude: Array = field(repr=False)
    phase: Array = field(repr=False)
    detuning: Array = field(repr=False)
    warming: Array = field(repr=False)
    power: Array = field(repr=False)

    @property
    def force(self) -> Array:
        """Steady force (N), shape (N,): a weaker vibration acts like a lower control voltage."""
        return force(self.control * self.amplitude)


def zero_phase(plate: Plate, compensation: float = 1.0) -> tuple[float, float] | None:
    """Detunings (Hz) at which voltage and whole current are in phase; None if there are none.

    ``Im Y = 0`` of ``Y = (1 / R) / (1 + j x) + j B``, ``x = delta / beta``. The loop settles at the
    first and is pushed away from the second, beyond which it runs off; with ``B = 0`` the second
    is infinite. They exist if ``B R <= 1 / 2``.
    """
    m = plate.susceptance * (1.0 - compensation) * plate.resistance
    width = plate.half_width / (2 * pi)
    if m == 0.0:
        return 0.0, float("inf")
    if abs(m) > 0.5:
        return None
    root = sqrt(1.0 - 4.0 * m**2)
    # the near root without cancellation
    return 2.0 * m / (1.0 + root) * width, (1.0 + root) / (2.0 * m) * width


def warm_detuning(plate: Plate, heating: Heating, control: float = M661.control) -> float:
    """Detuning (Hz) of a fixed drive that started at resonance, when the plate is warm.

    Less vibration heats less: ``x (1 + x^2) = x_full`` with ``x`` in half widths.
    """
    volt = M661.amplitude * control / M661.control
    full = volt**2 / (2 * plate.resistance) * heating.resistance
    largest = -heating.coefficient * full * plate.omega / plate.half_width
    roots = np.roots([1.0, 0.0, 1.0, -largest])
    x = float(roots[np.argmin(np.abs(roots.imag))].real)
    return x * plate.half_width / (2 * pi)


def run_plate(
    plate: Plate | None = None,
    heating: Heating | None = None,
    lock: PhaseLock | None = None,
    *,
    control: float = M661.control,
    detuning: float = 0.0,
    duration: float = 60.0,
    step: float = 1e-3,
) -> Tracked:
    """Drive a cold plate from time 0 on, with a phase-locked loop or at a fixed frequency.

    Parameters
    ----------
    lock : PhaseLock, optional
        Left out: the frequency stays.
    control : float
        V; the voltage on the plate is 60 V at 10 V. The sign says which electrode is driven, so it
        turns the force and nothing else.
    detuning : float
        Start frequency less the cold resonance, Hz.
    duration, step : float
        s; the step has to be short against the loop, not against the vibration.

    Raises
    ------
    UnusableInput
        The step is too long for the loop, or nothing drives the plate.
    """
    plate, heating = plate or Plate(), heating or Heating()
    size = abs(control)
    if not 0.0 < size < inf:
        raise UnusableInput(
            f"run_plate: control {control:g} V drives nothing that a phase could be told of; give "
            "some volts"
        )
    if lock is not None and 2 * pi * lock.bandwidth * step > 0.2:
        raise UnusableInput(
            f"run_plate: a step of {step:g} s is too long for a loop of {lock.bandwidth:g} Hz; "
            f"take at most {0.2 / (2 * pi * lock.bandwidth):.2g} s"
        )
    count = max(round(duration / step), 1)
    run = _runner(plate, heating, lock, step, count, size)
    start = np.array([0.0, 0.0, 0.0, 2 * pi * detuning, 2 * pi * detuning])
    z = np.hstack([start[:, None], np.asarray(run(start).full())])
    current = z[0] + 1j * z[1]
    volt = M661.amplitude * size / M661.control
    resonance = plate.omega * heating.coefficient * z[2]
    return Tracked(
        control,
        np.arange(count + 1) * step,
        np.abs(current) * plate.resistance / volt,
        np.angle(current),
        (z[4] - resonance) / (2 * pi),
        z[2],
        0.5 * volt * current.real,
    )


@lru_cache(maxsize=32)
def _runner(
    plate: Plate, heating: Heating, lock: PhaseLock | None, h: float, count: int, size: float
) -> Any:
    """Run of ``(Re i, Im i, warming, integral of the loop, drive frequency)``.

    The last two are in rad/s above the cold resonance. Each part is integrated exactly with the
    others held.
    """
    import casadi as ca

    z = ca.SX.sym("z", 5)
    volt = M661.amplitude * size / M661.control
    beta = plate.half_width
    delta = z[4] - plate.omega * heating.coefficient * z[2]
    # i = i_steady + (i - i_steady) exp(-(beta + j delta) h)
    x = delta / beta
    steady_re, steady_im = (volt / plate.resistance * v for v in (1 / (1 + x**2), -x / (1 + x**2)))
    decay, c, s = exp(-beta * h), ca.cos(delta * h), ca.sin(delta * h)
    off_re, off_im = z[0] - steady_re, z[1] - steady_im
    re = steady_re + decay * (c * off_re + s * off_im)
    im = steady_im + decay * (c * off_im - s * off_re)
    share = exp(-h / heating.time_constant)
    warm = share * z[2] + (1 - share) * heating.resistance * 0.5 * volt * re
    integral, drive = z[3], z[4]
    if lock is not None:
        rest = plate.susceptance * (1.0 - lock.compensation) * volt
        whole = im + rest
        error = whole / ca.sqrt(re**2 + whole**2 + 1e-30)
        low, high = -2 * pi * lock.span, 2 * pi * lock.span
        integral = z[3] + h * 2 * pi * lock.bandwidth * beta * error
        integral = ca.fmax(low, ca.fmin(high, integral))
        drive = ca.fmax(low, ca.fmin(high, integral + lock.proportional * beta * error))
    step = ca.Function("plate", [z], [ca.vertcat(re, im, warm, integral, drive)])
    return step.mapaccum(count)
