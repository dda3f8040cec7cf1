"""Dead times and laws of sensors whose state goes on from call to call."""

from __future__ import annotations

from typing import final

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from hardware.simulators.generator.sensing import sense
from hardware.simulators.generator.sizing import Sized

_NEEDS_TIME = ("linear_in_time", "warming_up")
_LAGS = {"sensor_first_order": 1, "sensor_two_lags": 2}


@final
class LateEdges:
    """A dead time of a command given by its edges; at rest before."""

    def __init__(self, steps: float) -> None:
        self._steps = steps
        # level taken in, level given out, edges on the way and what they bring
        self.state: tuple[float, float, Array, Array] = (0.0, 0.0, np.zeros(0), np.zeros(0))

    def pass_on(self, count: int, at: Array, u: Array) -> tuple[Array, Array]:
        """Take edges of `count` steps in and give the late ones out."""
        if not self._steps:
            return at, u
        taken, given, waiting, behind = self.state
        first = [0.0] if u[0] != taken else []
        waiting = np.concatenate([waiting, np.concatenate([first, at]) + self._steps])
        behind = np.concatenate([behind, u[1 - len(first) :]])
        due = int(np.searchsorted(waiting, count, side="left"))
        levels = np.concatenate([[given], behind[:due]])
        self.state = (float(u[-1]), float(levels[-1]), waiting[due:] - count, behind[due:])
        return waiting[:due], levels


class _Late:
    """A dead time of steps that need not be whole; at rest before."""

    def __init__(self, steps: float) -> None:
        self._part = steps - int(steps)
        self.kept = np.zeros(int(steps) + 1 if steps else 0)

    def pass_on(self, values: Array) -> Array:
        n, kept = values.size, self.kept.size
        if not kept:
            return values
        joined = np.concatenate([self.kept, values])
        self.kept = joined[joined.size - kept :].copy()
        return np.asarray((1.0 - self._part) * joined[1 : n + 1] + self._part * joined[:n])


@final
class SensorCarried:
    """A law of a sensor, carried on."""

    def __init__(self, effect: Sized, column: int, step: float, span: float) -> None:
        self.column = column
        self._law, self._numbers = effect.hidden.law, effect.numbers
        self._step, self._span = step, span
        self.carried: list[Array] = [np.zeros(1) for _ in range(_LAGS.get(self._law, 0))]
        if self._law == "sensor_dead_time":
            self.carried = [_Late(effect.numbers["time"] / step).kept]

    def read(self, y: Array, first: int) -> Array:
        """Return what the sensor says; `first` is the number of the first step."""
        p = self._numbers
        if self._law in _NEEDS_TIME:
            t = (first + np.arange(y.size)) * self._step / self._span
            if self._law == "linear_in_time":
                return np.asarray(y + p["rise"] * t)
            return np.asarray(y + p["rise"] * (1 - np.exp(-t / p["pace"])))
        if self._law == "sensor_dead_time":
            line = _Late(p["time"] / self._step)
            line.kept = self.carried[0]
            late = line.pass_on(y)
            self.carried = [line.kept]
            return late
        if self._law in _LAGS:
            for k in range(len(self.carried)):
                y = self._lag(y, k)
            return y
        return sense(self._law, p, y, 1, self._step)

    def _lag(self, y: Array, k: int) -> Array:
        from scipy.signal import lfilter

        # exact for straight lines between the ends of the steps, as in the trial's sensors
        ratio = self._step / self._numbers["time"]
        a = float(np.exp(-ratio))
        g = (1.0 - a) / ratio
        out, self.carried[k] = lfilter([1.0 - g, g - a], [1.0, -a], y, zi=self.carried[k])
        return np.asarray(out)
