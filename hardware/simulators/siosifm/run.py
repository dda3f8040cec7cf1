"""When the simulated interferometer takes its samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.noise import white
from hardware.simulators.rig import DeviceClock
from hardware.simulators.tape import GrowingTape

Edges = Callable[[int], Sequence[float]]
"""Gives the edges on a line but for the first so many."""

START = 0x01
CLOCK = 0x08
EVENT = 0x10


@final
class MeasurementRun:
    """One measurement: sample numbers and their true instants.

    Parameters
    ----------
    clock : DeviceClock
        The device's.
    rate : float
        Nominal rate (Hz).
    mode : int
        Trigger flags.
    now : float
        True time (s) when it was armed.
    starts, clocks : callable
        True instants (s) of the edges on the start input and on the clock or event input.
    late : float
        Delay of the start (s).
    """

    def __init__(
        self,
        clock: DeviceClock,
        rate: float,
        mode: int,
        now: float,
        starts: Edges,
        clocks: Edges,
        late: float = 0.0,
    ) -> None:
        self.rate = rate
        self.external = bool(mode & (CLOCK | EVENT))
        self._clock = clock
        self._starts, self._clocks = starts, clocks
        self._late = late
        self._edges_before = len(starts(0))
        self._ticks_before = len(clocks(0))
        self._known = GrowingTape(1)
        self._begin: float | None = None if mode & START else now
        self.armed = now

    def begin(self) -> float | None:
        """Return the true instant (s) of the start; None while it waits for its trigger."""
        if self._begin is None:
            edges = self._starts(self._edges_before)
            if edges:
                self._begin = edges[0] + self._late
        return self._begin

    def due(self, now: float) -> int:
        """Return the number of samples taken until a true time (s)."""
        begin = self.begin()
        if self.external:
            ticks = self._ticks()
            return int(np.searchsorted(ticks, now - self._clock.offset, side="right"))
        if begin is None:
            return 0
        c = self._clock
        own = passed = now - begin - c.offset
        if passed < -1e-10:  # a rounding before the first sample
            return 0
        for _ in range(3):
            own = passed / (1.0 + 1e-6 * c.ppm + 1e-6 * c.drift_ppm * own / 120.0)
        return int(np.floor(own * self.rate * (1.0 + 1e-12) + 1e-9)) + 1

    def instants(self, first: int, count: int) -> Array:
        """Return true instants (s) of samples `first`, ... (all of them due)."""
        if self.external:
            ticks = self._ticks()[first : first + count] + self._clock.offset
            if self._clock.jitter:
                ticks = ticks + self._clock.jitter * white(self._clock.seed, first, count)
            return np.asarray(ticks)
        begin = self.begin()
        return self._clock.instants(self.armed if begin is None else begin, first, count, self.rate)

    def _ticks(self) -> Array:
        """Edges of the clock input since the start; with one line, the start is the first."""
        more = self._clocks(self._ticks_before)
        self._ticks_before += len(more)
        begin = self.begin()
        if begin is None:
            return np.zeros(0)
        fresh = np.asarray(more, dtype=float)
        self._known.append(fresh[fresh >= begin - self._late])
        return self._known.column(0)
