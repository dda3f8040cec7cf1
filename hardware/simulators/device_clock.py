"""The clock of a simulated device against the true time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.noise import white


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
        """Return true instants (s) of samples `first`, ... behind the trigger at `start` (s)."""
        own = (first + np.arange(count)) / rate
        true = own * (1.0 + 1e-6 * self.ppm + 1e-6 * self.drift_ppm * own / 120.0)
        if self.jitter:
            true = true + self.jitter * white(self.seed, first, count)
        return np.asarray(start + self.offset + true)
