"""Laws of the generator's sensors whose state goes on from call to call."""

from __future__ import annotations

from typing import Any, final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.generator.sensing import sense
from hardware.simulators.generator.sizing import Sized
from hardware.simulators.plants.line import DelayLine

_LAGS = {"sensor_first_order": 1, "sensor_two_lags": 2}


@final
class SensorCarried:
    """A law of a sensor, carried on.

    Parameters
    ----------
    effect : Sized
        The law and its numbers.
    column : int
        Number of the sensor.
    step : float
        Step of the plant (s).
    span : float
        Time (s) in which what changes with time does so; it goes on after it.
    """

    def __init__(self, effect: Sized, column: int, step: float, span: float) -> None:
        self.column = column
        self._law, self._numbers = effect.hidden.law, effect.numbers
        self._step, self._span = step, span
        self._lags = [np.zeros(1) for _ in range(_LAGS.get(self._law, 0))]
        late = effect.numbers["time"] / step if self._law == "sensor_dead_time" else 0.0
        self._line = DelayLine(late, 0.0)

    def read(self, y: Array, first: int) -> Array:
        """Return what the sensor says; `first` is the number of the first step."""
        p = self._numbers
        if self._law in ("linear_in_time", "warming_up"):
            t = (first + np.arange(y.size)) * self._step / self._span
            gone = t if self._law == "linear_in_time" else 1.0 - np.exp(-t / p["pace"])
            return np.asarray(y + p["rise"] * gone)
        if self._law == "sensor_dead_time":
            return self._line.pass_on(y)
        if self._law in _LAGS:
            for k in range(len(self._lags)):
                y = self._lag(y, k)
            return y
        return sense(self._law, p, y, 1, self._step)

    def snapshot(self) -> Any:
        """Return a copy of the state."""
        return [z.copy() for z in self._lags], self._line.snapshot()

    def restore(self, state: Any) -> None:
        """Put a state back."""
        lags, line = state
        self._lags = [z.copy() for z in lags]
        self._line.restore(line)

    def _lag(self, y: Array, k: int) -> Array:
        from scipy.signal import lfilter

        # exact for straight lines between the ends of the steps, as in the generator's sensors
        ratio = self._step / self._numbers["time"]
        a = float(np.exp(-ratio))
        g = (1.0 - a) / ratio
        out, self._lags[k] = lfilter([1.0 - g, g - a], [1.0, -a], y, zi=self._lags[k])
        return np.asarray(out)
