"""The data recorder of the simulated controller."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.controllers.gcs_model import GcsModel
from hardware.simulators.noise import white
from hardware.simulators.rig import DeviceClock, Rig

OPTIONS = {
    0: "Nothing is recorded",
    2: "Current Position of axis",
    7: "Control Voltage of output chan",
    16: "Voltage of output chan",
}
"""Record options that it knows, with the names of the public lists."""

_LOOK = 1.0


@final
class DataRecorder:
    """Tables filled at the controller's own instants.

    Parameters
    ----------
    rig : Rig
        The bench.
    clock : DeviceClock
        The controller's own clock.
    model : GcsModel
        Sizes and noise.
    """

    def __init__(self, rig: Rig, clock: DeviceClock, model: GcsModel) -> None:
        self._rig = rig
        self._clock = clock
        self._model = model
        self.options = {k: (model.axis, 2 if k == 1 else 0) for k in range(1, model.tables + 1)}
        self.divider = 1
        self.trigger = 0
        self._start: float | None = None
        self.forget()

    @property
    def capacity(self) -> int:
        """Points of one table."""
        return self._model.points // self._model.tables

    @property
    def period(self) -> float:
        """Nominal time between points (s)."""
        return self._model.servo_time * self.divider

    def start(self) -> None:
        """Record from now on, until the tables are full."""
        self.forget()
        self._start = self._rig.now
        self._look(self._start)

    def forget(self) -> None:
        """Empty the tables and record nothing."""
        self._start = None
        self._x = np.zeros(0)
        self._v = np.zeros(0)

    def recorded(self) -> int:
        """Points that are there by now."""
        self._collect()
        return self._x.size

    def columns(self, tables: list[int], first: int, count: int) -> NDArray[np.float64]:
        """Values of some tables, ``(n, tables)``, from the point `first` (from 0) on."""
        self._collect()
        stop = min(first + count, self._x.size)
        by_option = {2: self._x, 7: self._v, 16: self._v}
        nothing = np.zeros(self._x.size)
        return np.stack(
            [by_option.get(self.options[t][1], nothing)[first:stop] for t in tables], axis=1
        )

    def _look(self, start: float) -> None:
        """Come by before the bench forgets."""
        if self._start != start:
            return
        self._collect()
        if self._x.size < self.capacity:
            self._rig.at(self._rig.now + _LOOK, lambda: self._look(start))

    def _collect(self) -> None:
        if self._start is None or self._x.size >= self.capacity:
            return
        now, first = self._rig.now, self._x.size
        room = self.capacity - first
        guess = int((now - self._start) / self.period * (1.0 + 1e-3)) + 2 - first
        if guess <= 0:
            return
        t = self._clock.instants(self._start, first, min(guess, room), 1.0 / self.period)
        late = np.flatnonzero(t > now)
        t = t[: late[0]] if late.size else t
        if not t.size:
            return
        seen = self._rig.seen(t)
        m = self._model
        x = 1e6 * (seen.x + m.noise * white(m.seed + 1, first, t.size))
        v = seen.v + m.voltage_noise * white(m.seed + 2, first, t.size)
        self._x = np.concatenate([self._x, x])
        self._v = np.concatenate([self._v, v])
