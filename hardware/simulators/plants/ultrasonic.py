"""The plate actuator M-661 with its driver: control voltage to the motion of a stage.

From the text of the stack actuator thesis (chapter 8): a dead zone of about 2 V, the full force
from about 6 V on, 1 N and 0.5 m/s, 18 mm of travel, 2 N of holding force, an output that is not
steady and less so where it is low. What lies between is chosen here, apart from the project's
models: the bench must differ from what is fitted to it.
"""

from __future__ import annotations

import math
from typing import Any, final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.plant_contract import PlantMotion

_VOLTS = (0.0, 2.1, 2.8, 3.7, 4.8, 6.1, 10.0)
_SHARE = (0.0, 0.0, 0.35, 0.69, 0.90, 1.0, 1.0)
_LARGEST, _HOLDING, _END = 1.0, 2.0, 9e-3
_MASS, _DAMPING, _LAG = 11e-3, 1.9, 160e-6
_WANDER = 0.05
"""Time in which the output wanders (s)."""


@final
class UltrasonicPlant:
    """A stage between two ends of travel, in the middle of which it starts at rest.

    Parameters
    ----------
    seed : int
        Of what makes the output unsteady.
    spring : float
        Of a force gauge that the stage is pressed against (N/m); 0 for a free stage.
    unsteady : float
        Relative standard deviation of the force at full drive; it grows below.
    friction : float
        Dry friction of the guide while the plate vibrates (N).
    step : float
        s.
    """

    def __init__(
        self,
        seed: int = 0,
        *,
        spring: float = 0.0,
        unsteady: float = 0.05,
        friction: float = 0.05,
        step: float = 5e-5,
    ) -> None:
        self.step = step
        self._spring, self._unsteady, self._friction = spring, unsteady, friction
        self._rng = np.random.default_rng([seed, 661])
        self._x = self._v = self._a = self._wander = 0.0

    def advance(self, volts: Array) -> PlantMotion:
        """Go on by one step per control voltage (V), ``(n,)``."""
        h, n = self.step, len(volts)
        build, keep = 1.0 - math.exp(-h / _LAG), math.exp(-h / _WANDER)
        kicks = math.sqrt(1.0 - keep * keep) * self._rng.standard_normal(n)
        x, v, a, wander = self._x, self._v, self._a, self._wander
        path = np.empty(n)
        for k in range(n):
            a += build * (min(max(float(volts[k]), -10.0), 10.0) - a)
            wander = keep * wander + float(kicks[k])
            size = abs(a)
            share = float(np.interp(size, _VOLTS, _SHARE))
            scatter = self._unsteady * wander * (2.0 - share)
            force = math.copysign(_LARGEST * share * (1.0 + scatter), a) - self._spring * x
            free = (v + h * force / _MASS) / (1.0 + h * _DAMPING / _MASS)
            rest = self._friction + _HOLDING * max(0.0, 1.0 - size / _VOLTS[1])
            stop = h * rest / _MASS
            v = math.copysign(max(abs(free) - stop, 0.0), free)
            x += h * v
            if abs(x) > _END:
                x, v = math.copysign(_END, x), 0.0
            path[k] = x
        self._x, self._v, self._a, self._wander = x, v, a, wander
        return PlantMotion(path, np.full(n, math.nan))

    def snapshot(self) -> Any:
        """Return a copy of the whole state."""
        return self._x, self._v, self._a, self._wander, self._rng.bit_generator.state

    def restore(self, state: Any) -> None:
        """Put a state back."""
        self._x, self._v, self._a, self._wander, self._rng.bit_generator.state = state
