"""A vibrating plate that warms: what an oscillator drives and a phase detector looks at.

Series branch of the equivalent circuit about its resonance, for the complex amplitude ``i`` of the
current by that at resonance: ``i' = -(b + j d) i + b`` with the half width ``b`` and the detuning
``d``; the drive is ``tuning`` Hz per volt off 215 kHz. The power warms the plate, which moves the
resonance. The reading is ``-sin`` of the current's phase, what a detector makes of it: positive
where the drive is too fast. The quadrature of the capacitance beside the branch is taken as
compensated.
"""

from __future__ import annotations

import cmath
import math
from typing import Any, final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.plant_contract import PlantMotion

_FREQUENCY, _QUALITY, _POWER = 215e3, 100.0, 5.0
_WARMING, _COEFFICIENT = 6.0, -150e-6


@final
class PlatePlant:
    """The plate behind its oscillator; the "displacement" is the reading of the detector (1).

    Parameters
    ----------
    tuning : float
        Hz per volt.
    warming : float
        Time constant of the temperature (s).
    aside : float
        By which the cold resonance lies off the frequency at 0 V (Hz).
    step : float
        s.
    """

    def __init__(
        self, tuning: float = 1e3, warming: float = 15.0, aside: float = 0.0, step: float = 5e-5
    ) -> None:
        self.step = step
        self._tuning, self._warming, self._aside = tuning, warming, aside
        self._half = math.pi * _FREQUENCY / _QUALITY
        self._i, self._kelvin = complex(1e-9), 0.0

    @property
    def resonance(self) -> float:
        """Resonance now, off the frequency at 0 V (Hz)."""
        return self._aside + _COEFFICIENT * self._kelvin * _FREQUENCY

    def advance(self, volts: Array) -> PlantMotion:
        """Go on by one step per tuning voltage (V), ``(n,)``; exact with the detuning held."""
        h, n, half = self.step, len(volts), self._half
        cool = 1.0 - math.exp(-h / self._warming)
        i, kelvin = self._i, self._kelvin
        lag, size = np.empty(n), np.empty(n)
        for k in range(n):
            resonance = self._aside + _COEFFICIENT * kelvin * _FREQUENCY
            detuning = 2.0 * math.pi * (self._tuning * float(volts[k]) - resonance)
            pole = complex(half, detuning)
            steady = half / pole
            i = steady + (i - steady) * cmath.exp(-pole * h)
            kelvin += cool * (_WARMING * _POWER * max(i.real, 0.0) - kelvin)
            size[k] = abs(i)
            lag[k] = -i.imag / max(abs(i), 1e-9)
        self._i, self._kelvin = i, kelvin
        return PlantMotion(lag, size)

    def snapshot(self) -> Any:
        """Return a copy of the whole state."""
        return self._i, self._kelvin

    def restore(self, state: Any) -> None:
        """Put a state back."""
        self._i, self._kelvin = state
