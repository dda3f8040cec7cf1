"""What moves the reading without the actuator: air in the dead path, a floor that shakes, noise.

Each is a function of the number of the step, so that a record does not depend on how it was cut
into pieces, and the same seed gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.noise import white
from hardware.simulators.plant_contract import Moved, Plant, PlantMotion
from hardware.simulators.plants.wrapped import WrappedPlant

_PER_KELVIN = -9.5e-7
_PER_PASCAL = 2.7e-9


def _times(first: int, count: int, step: float) -> Array:
    return np.asarray((first + np.arange(count)) * step, dtype=np.float64)


class Disturbance(Protocol):
    """What is added to the readings."""

    def added(self, first: int, count: int, step: float) -> tuple[Array | float, Array | float]:
        """Return what is added to displacement (m) and current (A) at steps `first`, ..."""
        ...


@dataclass(frozen=True, slots=True)
class AirPath:
    """Air that warms and stirs in the dead path of an interferometer.

    The index of air falls by 9.5e-7 per kelvin and rises by 2.7e-9 per pascal; an unchanged dead
    path L reads ``L (n - n_0)`` more.

    Parameters
    ----------
    length : float
        Dead path (m).
    kelvin_per_hour : float
        Warming of the room.
    swing : float
        Amplitude of a slow swing of the temperature (K), as of an air conditioner.
    period : float
        Of the swing (s).
    stir : float
        Rms of the turbulence (K), correlated over some tenths of a second.
    pascal_per_hour : float
        Rise of the pressure.
    seed : int
        Of the turbulence.
    """

    length: float = 0.1
    kelvin_per_hour: float = 0.0
    swing: float = 0.0
    period: float = 600.0
    stir: float = 0.0
    pascal_per_hour: float = 0.0
    seed: int = 0

    def kelvin(self, time: Array) -> Array:
        """Return the rise of the temperature since the start (K) at times (s)."""
        rise = np.asarray(self.kelvin_per_hour / 3600.0 * time)
        if self.swing:
            rise = rise + self.swing * np.sin(2.0 * np.pi / self.period * time)
        if self.stir:
            knots = _smooth(self.seed, time / _KNOT) - _smooth(self.seed, np.zeros(1))
            rise = rise + self.stir * knots
        return np.asarray(rise)

    def added(self, first: int, count: int, step: float) -> tuple[Array | float, Array | float]:
        """Return what is added to the displacement (m)."""
        time = _times(first, count, step)
        index = _PER_KELVIN * self.kelvin(time)
        index = index + _PER_PASCAL * self.pascal_per_hour / 3600.0 * time
        return np.asarray(self.length * index), 0.0


_KNOT = 0.1
"""Distance of the knots of turbulence (s)."""


def _smooth(seed: int, position: Array) -> Array:
    """Noise of unit rms between random knots, weighted so that its rms is the same everywhere."""
    begin = int(position.min())
    count = int(position.max()) + 2 - begin
    knots = white(seed, begin, count + 1, stream=17)
    k = position.astype(np.int64) - begin
    s = position - position.astype(np.int64)
    a, b = np.cos(0.5 * np.pi * s), np.sin(0.5 * np.pi * s)
    return np.asarray(a * knots[k] + b * knots[k + 1])


@dataclass(frozen=True, slots=True)
class Vibration:
    """A floor that shakes at fixed frequencies.

    Parameters
    ----------
    lines : sequence of (float, float)
        Frequency (Hz) and amplitude (m).
    seed : int
        Of the phases.
    """

    lines: Sequence[tuple[float, float]] = ()
    seed: int = 0

    def added(self, first: int, count: int, step: float) -> tuple[Array | float, Array | float]:
        """Return what is added to the displacement (m)."""
        time = _times(first, count, step)
        phases = 2.0 * np.pi * np.random.default_rng(self.seed).random(len(self.lines))
        total = np.zeros(count)
        for (frequency, amplitude), phase in zip(self.lines, phases, strict=True):
            total += amplitude * np.sin(2.0 * np.pi * frequency * time + phase)
        return total, 0.0


@dataclass(frozen=True, slots=True)
class Press:
    """A slow force against the motion, ``F/2 (1 - cos 2 pi t / period)``: ``x`` falls by F / k.

    Parameters
    ----------
    largest : float
        N.
    period : float
        s; long against the swings of the actuator.
    stiffness : float
        At constant voltage, N/m.
    """

    largest: float
    period: float
    stiffness: float

    def force(self, time: Array) -> Array:
        """Return the force (N) at times (s)."""
        return np.asarray(0.5 * self.largest * (1.0 - np.cos(2.0 * np.pi * time / self.period)))

    def added(self, first: int, count: int, step: float) -> tuple[Array | float, Array | float]:
        """Return what is added to the displacement (m)."""
        return -self.force(_times(first, count, step)) / self.stiffness, 0.0


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """White noise at the steps of the plant; between them it is interpolated with the readings.

    Parameters
    ----------
    x, i : float
        Standard deviations (m, A).
    seed : int
        Seed.
    """

    x: float = 0.0
    i: float = 0.0
    seed: int = 0

    def added(self, first: int, count: int, step: float) -> tuple[Array | float, Array | float]:
        """Return what is added to displacement (m) and current (A)."""
        x = self.x * white(self.seed, first, count, stream=1) if self.x else 0.0
        return x, self.i * white(self.seed, first, count, stream=2) if self.i else 0.0


@final
class Disturbed(WrappedPlant):
    """A plant whose readings are disturbed.

    Parameters
    ----------
    plant : Plant
        The plant.
    disturbances : Disturbance
        What is added, in any number.
    """

    def __init__(self, plant: Plant, *disturbances: Disturbance) -> None:
        super().__init__(plant)
        self._disturbances = disturbances
        self._done = 1

    def _read(self, moved: Moved) -> PlantMotion:
        x, i = moved.x, moved.i
        for each in self._disturbances:
            dx, di = each.added(self._done, x.size, self.step)
            x, i = x + dx, i + di
        self._done += x.size
        return PlantMotion(np.asarray(x), np.asarray(i))

    def snapshot(self) -> Any:
        """Return a copy of the state."""
        return self._done, self._state.snapshot()

    def restore(self, state: Any) -> None:
        """Put a state back."""
        self._done, inner = state
        self._state.restore(inner)
