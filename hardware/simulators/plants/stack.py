"""The stack bench that goes on: any truth of `draw_truth` as a plant of the virtual bench."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from dataclasses import astuple
from typing import Any, final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.draw import Truth
from hardware.simulators.edges import EdgeDelay, as_edges
from hardware.simulators.effects import HiddenEffect
from hardware.simulators.excitation import N_SAMPLES, SAMPLE_RATE
from hardware.simulators.integrator import SteppedSystem
from hardware.simulators.nonsmooth import DryFrictionPlant, MaxwellSlipPlant
from hardware.simulators.plant import BIAS, CreepingPlant, LaggedPlant, LinearPlant, PolynomialPlant
from hardware.simulators.plant_contract import PlantMotion
from hardware.simulators.plants.line import DelayLine
from hardware.simulators.plants.native import library, pointer
from hardware.simulators.simulation import make_system, static_drive

STEP = 5e-6
"""Step of the plant (s): 1/7 of the shortest charging time that is drawn, 1/40 of a period."""

SUBSTEPS = 2
"""Steps of the integrator in one of the plant."""

_PLACES = {"C_nl": 0, "k": 1}


@final
class StackPlant:
    """A stack with a concealed effect, at rest at a voltage until it is driven.

    The displacement is counted from that rest. Static curves of sensors are centred where the
    drawn bench centres them: at rest at 50 V, at no current. The strength that a truth promises
    holds for the record it was sized on, not for every waveform.

    Parameters
    ----------
    truth : Truth
        Parameters and effect; its noise is left to the sensors.
    volts : float
        Voltage of the first state (V).
    span : float
        Time (s) in which a sensor that drifts makes the drift of the truth; it goes on after it.
    step : float
        Step (s).
    compiled : bool
        Whether to use compiled code, if there is gcc.
    """

    def __init__(
        self,
        truth: Truth,
        *,
        volts: float = 0.0,
        span: float = N_SAMPLES / SAMPLE_RATE,
        step: float = STEP,
        compiled: bool = True,
    ) -> None:
        self._effect = truth.effect
        self.step = step
        self._span = span
        self._done = 0
        driven = float(static_drive(np.array([volts]), self._effect)[0])
        system = make_system(truth.plant, self._effect, driven)
        self._system = system
        self._library = library() if compiled else None
        self._six = np.array(astuple(truth.plant))
        self._kind, self._place, self._n, numbers = _as_numbers(system)
        self._numbers = np.array(numbers, dtype=float)
        self._y = np.zeros(16)
        self._y[: len(system.start)] = system.start
        self._centre = truth.plant.T * truth.plant.C_q * BIAS
        late = self._late("V_in"), self._late("x"), self._late("i")
        current = system.current(system.start, driven)
        self._lines: tuple[EdgeDelay, DelayLine, DelayLine] = (
            EdgeDelay(late[0] / step, driven),
            DelayLine(late[1] / step, system.start[1]),
            DelayLine(late[2] / step, current),
        )
        self._zero = 0.0
        self._zero = float(self._sense(np.array([system.start[1]]), "x", 0)[0])

    def advance(self, volts: Array) -> PlantMotion:
        """Go on by one step per voltage (V), ``(n,)``."""
        return self.advance_edges(len(volts), *as_edges(np.asarray(volts, dtype=np.float64)))

    def advance_edges(self, count: int, at: Array, volts: Array) -> PlantMotion:
        """Go on by `count` steps with edges of the voltage inside them, see `EdgeDriven`."""
        drive, late_x, late_i = self._lines
        at, u = drive.pass_on(count, at, static_drive(volts, self._effect))
        x, i = self._march(count, np.ascontiguousarray(at), np.ascontiguousarray(u))
        x = self._sense(late_x.pass_on(x), "x", self._done + 1)
        i = self._sense(late_i.pass_on(i), "i", self._done + 1)
        self._done += count
        return PlantMotion(x, i)

    def snapshot(self) -> Any:
        """Return a copy of the state."""
        return self._y.copy(), self._done, *(line.snapshot() for line in self._lines)

    def restore(self, state: Any) -> None:
        """Put a state back."""
        y, self._done, drive, x, i = state
        self._y[:] = y
        self._lines[0].restore(drive)
        self._lines[1].restore(x)
        self._lines[2].restore(i)

    def _late(self, place: str) -> float:
        effect = self._effect
        return effect.value("samples") / SAMPLE_RATE if _is(effect, "delay", place) else 0.0

    def _march(self, count: int, at: Array, u: Array) -> tuple[Array, Array]:
        x, i = np.empty(count), np.empty(count)
        if self._library is None:
            self._march_slowly(at, u, x, i)
            return x, i
        self._library.stack_advance(
            ctypes.c_int(self._kind),
            ctypes.c_int(self._place),
            ctypes.c_int(self._n),
            pointer(self._six),
            pointer(self._numbers),
            pointer(self._y),
            ctypes.c_long(count),
            ctypes.c_int(SUBSTEPS),
            ctypes.c_double(self.step),
            ctypes.c_long(at.size),
            pointer(at),
            pointer(u),
            pointer(x),
            pointer(i),
        )
        return x, i

    def _march_slowly(self, at: Array, u: Array, x: Array, i: Array) -> None:
        """Step the bench's own equations; about 10 us a step."""
        n, e, volts = len(self._system.start), 0, float(u[0])
        y = tuple(self._y[:n].tolist())
        for k in range(x.size):
            begin = float(k)
            while begin < k + 1:
                while e < at.size and at[e] <= begin:
                    e += 1
                    volts = float(u[e])
                end = float(at[e]) if e < at.size and at[e] < k + 1 else k + 1.0
                pieces = max(math.ceil((end - begin) * SUBSTEPS - 1e-9), 1)
                for _ in range(pieces):
                    y = self._system.step(y, (end - begin) * self.step / pieces, volts, volts)
                begin = end
            x[k], i[k] = y[1], self._system.current(y, volts)
        self._y[:n] = y

    def _sense(self, reading: Array, channel: str, first: int) -> Array:
        """Curve and drift of a sensor, and its zero."""
        effect, centre = self._effect, self._centre if channel == "x" else 0.0
        zero = self._zero if channel == "x" else 0.0
        if _is(effect, "sensor_nonlinearity", channel):
            r = reading - centre
            reading = centre + r + r**2 * (effect.value("s2") + effect.value("s3") * r)
        if _is(effect, "sensor_drift", channel):
            s = (first + np.arange(reading.size)) * self.step / self._span
            reading = reading + effect.value("linear") * s
            reading = reading + effect.value("bow") * np.sin(np.pi * s)
        return np.asarray(reading - zero)


def _is(effect: HiddenEffect, name: str, place: str) -> bool:
    return (effect.name, effect.place) == (name, place)


def _as_numbers(system: SteppedSystem) -> tuple[int, int, int, Sequence[float]]:
    """Kind, place, number of branches and numbers of a law as the C code reads them."""
    match system:
        case LinearPlant():
            return 0, 0, 0, (0.0,) * 5
        case PolynomialPlant():
            return 0, 0, 0, (*system.dielectric, *system.spring, system.drag)
        case LaggedPlant():
            return 1, 0, 0, (system.tau,)
        case CreepingPlant():
            n = len(system.ratios)
            return 2, _PLACES[system.place], n, (*system.ratios, *system.taus)
        case MaxwellSlipPlant():
            n = len(system.radii)
            return 3, _PLACES[system.place], n, (*system.radii, *system.gains)
        case DryFrictionPlant():
            return 4, 0, 0, (system.F_c, system.F_s, system.v_s)
    raise TypeError(f"no compiled form of {type(system).__name__}")
