"""The wave generator of the simulated controller: plays its table on the time of the bench."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.controllers.gcs_model import GcsModel, Refusal
from hardware.simulators.rig import DeviceClock, Rig

_BLOCK = 1024


@final
class Generator:
    """One generator with its tables, rate, cycles and trigger points.

    Parameters
    ----------
    rig : Rig
        The bench.
    clock : DeviceClock
        The controller's own clock.
    model : GcsModel
        Limits and sizes.
    write : callable
        Puts a voltage on the output (V).
    """

    def __init__(
        self, rig: Rig, clock: DeviceClock, model: GcsModel, write: Callable[[float], None]
    ) -> None:
        self._rig = rig
        self._clock = clock
        self._model = model
        self._write = write
        self.tables: dict[int, NDArray[np.float64]] = {}
        self.table = 0
        self.cycles = 0
        self.divider = 1
        self.offset = 0.0
        self.points: dict[int, dict[int, int]] = {}
        """Trigger points by line: number from 1, and 1 for high."""
        self.modes: dict[int, int] = {}
        """Trigger mode by line; 4 is that of the generator."""
        self.running = False
        self.wire = 1
        """Line that leads to the trigger input of the bench."""
        self._run = 0

    def append(self, table: int, mode: str, values: list[float]) -> None:
        """Put values (V) into a table: X new, & behind, + on top."""
        new = np.array(values)
        old = self.tables.get(table, np.zeros(0))
        if mode == "&":
            new = np.concatenate([old, new])
        elif mode == "+":
            if old.size != new.size:
                raise Refusal(70)
            new = old + new
        elif mode != "X":
            raise Refusal(1)
        if new.size > self._model.points:
            raise Refusal(403)
        self.tables[table] = new

    def start(self) -> None:
        """Start from the first point."""
        wave = self.tables.get(self.table)
        if self.table == 0:
            raise Refusal(75)
        if wave is None or wave.size == 0:
            raise Refusal(401)
        wave = wave + self.offset
        if wave.min() < self._model.lowest or wave.max() > self._model.highest:
            raise Refusal(302)
        self._run += 1
        self._wave = wave
        self._start = self._rig.now
        self._rate = 1.0 / (self._model.servo_time * self.divider)
        self._index = 0
        self._high = False
        self._block = (0, np.zeros(0))
        self.running = True
        self._action = partial(self._sample, self._run)
        self._rig.at(self._instant(0), self._action)

    def stop(self) -> None:
        """Stop; the output keeps its value."""
        self._run += 1
        self.running = False

    def _sample(self, run: int) -> None:
        if run != self._run:
            return
        total = self._wave.size * self.cycles
        if self.cycles and self._index >= total:
            self.running = False
            return
        point = self._index % self._wave.size
        self._write(float(self._wave[point]))
        if self.modes.get(self.wire) == 4:
            self._switch(self.points.get(self.wire, {}).get(point + 1, 0) == 1)
        self._index += 1
        self._rig.at(self._instant(self._index), self._action)

    def _switch(self, high: bool) -> None:
        if high and not self._high:
            self._rig.trigger()
        self._high = high

    def _instant(self, k: int) -> float:
        first, block = self._block
        if k >= first + block.size:
            block = self._clock.instants(self._start, k, _BLOCK, self._rate)
            # no jitter makes the samples change places
            block = np.maximum.accumulate(np.maximum(block, self._rig.now))
            first = k
            self._block = (first, block)
        return float(block[k - first])
