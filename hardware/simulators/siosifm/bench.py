"""The smallest bench for the interferometer alone."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.plant_contract import PlantMotion
from hardware.simulators.rig import Rig

__all__ = ["Follower", "RigClock"]

Array = NDArray[np.float64]


@final
class Follower:
    """A plant that follows its voltage at once.

    Parameters
    ----------
    gain : float
        m/V.
    step : float
        s.
    """

    def __init__(self, gain: float = 1e-7, step: float = 1e-4) -> None:
        self._gain = gain
        self._step = step

    @property
    def step(self) -> float:
        """Step (s)."""
        return self._step

    def advance(self, volts: Array) -> PlantMotion:
        """Go on by one step per voltage."""
        return PlantMotion(self._gain * np.asarray(volts), np.zeros(len(volts)))


@final
class RigClock:
    """Time of a rig in the same process; sleeping makes it pass.

    Parameters
    ----------
    rig : Rig
        The bench.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    def now(self) -> float:
        """Present time (s)."""
        return self._rig.now

    def sleep(self, seconds: float) -> None:
        """Let time pass (s)."""
        self._rig.wait(seconds)
