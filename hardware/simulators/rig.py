"""One virtual bench: a true time, a terminal voltage, a plant that follows it.

Time passes only by `wait`; reading does not make it pass. Devices in front of it have clocks of
their own (`DeviceClock`) and ask for the state at instants of the past.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.plant_contract import Plant

__all__ = ["DeviceClock", "Extremes", "Rig", "Seen"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class DeviceClock:
    """How the clock of a device runs against the true time.

    Parameters
    ----------
    ppm : float
        Its samples come by so many millionths later than its nominal rate says.
    offset : float
        Delay of its start behind the trigger (s).
    jitter : float
        Standard deviation of a single instant (s).
    drift_ppm : float
        Change of ``ppm`` in a minute.
    seed : int
        Of the jitter.
    """

    ppm: float = 0.0
    offset: float = 0.0
    jitter: float = 0.0
    drift_ppm: float = 0.0
    seed: int = 0

    def instants(self, start: float, first: int, count: int, rate: float) -> Array:
        """Return true instants (s) of samples `first`, ...; counted from the trigger at `start` (s)."""
        own = (first + np.arange(count)) / rate
        true = own * (1.0 + 1e-6 * self.ppm + 1e-6 * self.drift_ppm * own / 120.0)
        if self.jitter:
            rng = np.random.default_rng([self.seed, first, count])
            true = true + self.jitter * rng.standard_normal(count)
        return np.asarray(start + self.offset + true)


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """State at some instants: displacement (m), current (A), terminal voltage (V), ``(n,)``."""

    x: Array
    i: Array
    v: Array


@dataclass(frozen=True, slots=True)
class Extremes:
    """The worst that the actuator has met since the start.

    Parameters
    ----------
    lowest, highest : float
        Terminal voltage (V).
    largest_step : float
        Largest sudden change of the voltage (V).
    """

    lowest: float
    highest: float
    largest_step: float


@final
class Rig:
    """The bench itself.

    Parameters
    ----------
    plant : Plant
        What stands on it.
    keep : float
        Past that can still be asked for (s).
    """

    def __init__(self, plant: Plant, keep: float = 60.0) -> None:
        self._plant = plant
        self._step = plant.step
        self._keep = max(int(keep / self._step), 16)
        self._now = 0.0
        self._volts = 0.0
        self._level = 0.0
        self._edges: list[tuple[float, float]] = []
        self._done = 1
        self._first = 0
        self._x = np.zeros(1)
        self._i = np.zeros(1)
        self._v = np.zeros(1)
        self._extremes = Extremes(0.0, 0.0, 0.0)
        self._edges_seen: list[float] = []
        self.lock = threading.RLock()

    @property
    def now(self) -> float:
        """True time (s)."""
        return self._now

    @property
    def volts(self) -> float:
        """Terminal voltage now (V)."""
        return self._volts

    @property
    def extremes(self) -> Extremes:
        """Worst voltages so far."""
        return self._extremes

    @property
    def trigger_edges(self) -> tuple[float, ...]:
        """True instants (s) of all edges on the trigger line."""
        return tuple(self._edges_seen)

    def trigger(self) -> None:
        """Put an edge on the trigger line now."""
        with self.lock:
            self._edges_seen.append(self._now)

    def wait(self, seconds: float) -> None:
        """Let time pass (s)."""
        with self.lock:
            self._now += max(seconds, 0.0)
            if (self._now / self._step) - self._done > self._keep / 4:
                self._catch_up()

    def wait_until(self, instant: float) -> None:
        """Let time pass until a true instant (s); nothing if it is past."""
        with self.lock:
            self.wait(instant - self._now)

    def drive(self, volts: float) -> None:
        """Put a voltage (V) on the terminals from now on."""
        with self.lock:
            e = self._extremes
            self._extremes = Extremes(
                min(e.lowest, volts),
                max(e.highest, volts),
                max(e.largest_step, abs(volts - self._volts)),
            )
            self._volts = volts
            self._edges.append((self._now, volts))

    def seen(self, instants: Array) -> Seen:
        """State at instants (s, not later than now; ends are held), ``(n,)``."""
        with self.lock:
            self._catch_up()
            position = np.asarray(instants) / self._step - self._first
            return Seen(
                _cubic(self._x, position), _linear(self._i, position), _held(self._v, position)
            )

    def _catch_up(self) -> None:
        """Advance the plant to the last whole step of now."""
        last = int(self._now / self._step) + 1
        count = last - self._done
        if count <= 0:
            return
        volts = self._averages(self._done - 1, count)
        motion = self._plant.advance(volts)
        self._x = np.concatenate([self._x, motion.x])
        self._i = np.concatenate([self._i, motion.i])
        self._v = np.concatenate([self._v, volts])
        self._done = last
        surplus = self._x.size - self._keep
        if surplus > self._keep // 4:
            self._x, self._i, self._v = (a[surplus:] for a in (self._x, self._i, self._v))
            self._first += surplus

    def _averages(self, start: int, count: int) -> Array:
        """Mean voltage in steps `start` ...: exact for edges within a step."""
        begin = start * self._step
        end = begin + count * self._step
        t = np.array([e[0] for e in self._edges])
        level = np.array([self._level, *(e[1] for e in self._edges)])
        inside = t < end
        knots = np.concatenate([[begin], np.clip(t[inside], begin, end), [end]])
        values = level[: knots.size - 1]
        integral = np.concatenate([[0.0], np.cumsum(values * np.diff(knots))])
        grid = begin + self._step * np.arange(count + 1)
        grid[-1] = end
        area = np.interp(grid, knots, integral)
        self._level = float(values[-1])
        self._edges = [e for e, used in zip(self._edges, inside, strict=True) if not used]
        return np.asarray(np.diff(area) / self._step)


def _linear(values: Array, position: Array) -> Array:
    return np.asarray(np.interp(position, np.arange(values.size), values))


def _held(values: Array, position: Array) -> Array:
    return np.asarray(values[np.clip(np.ceil(position).astype(int), 0, values.size - 1)])


def _cubic(values: Array, position: Array) -> Array:
    """Four-point Lagrange interpolation; linear at the ends."""
    if values.size < 4:
        return _linear(values, position)
    k = np.clip(np.floor(position).astype(int), 1, values.size - 3)
    s = np.clip(position, 0.0, values.size - 1.0) - k
    a, b, c, d = (values[k + j] for j in (-1, 0, 1, 2))
    return np.asarray(
        -s * (s - 1.0) * (s - 2.0) / 6.0 * a
        + (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0 * b
        - (s + 1.0) * s * (s - 2.0) / 2.0 * c
        + (s + 1.0) * s * (s - 1.0) / 6.0 * d
    )
