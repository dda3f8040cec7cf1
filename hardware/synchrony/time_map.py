"""Time of the drive over time of the sensor: a start, a ratio and its change."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.support.errors import UnusableInput

__all__ = ["TimeMap"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TimeMap:
    """What the drive's clock reads when the sensor's clock reads ``t``.

    ``s(t) = delay + t + skew t + drift t^2 / 2``, both clocks counted in nominal seconds from the
    first sample of their own stream.

    Parameters
    ----------
    delay : float
        The first sensor sample is taken so much after the first sample of the drive (s).
    skew : float
        Ratio of the clocks less one, at the start: 1e-6 is one part per million.
    drift : float
        Change of the ratio in a second (1/s).

    Raises
    ------
    UnusableInput
        If a number is not finite, or time would run backwards.

    Examples
    --------
    >>> round(float(TimeMap(skew=100e-6).to_drive(10.0)), 6)
    10.001
    """

    delay: float = 0.0
    skew: float = 0.0
    drift: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not all(math.isfinite(v) for v in (self.delay, self.skew, self.drift)):
            raise UnusableInput(f"time map: {self} is not finite")
        if self.skew <= -1.0:
            raise UnusableInput(f"time map: skew {self.skew:g} lets time run backwards")

    @property
    def ratio(self) -> float:
        """Seconds of the drive's clock in one of the sensor's, at the start."""
        return 1.0 + self.skew

    def to_drive(self, time: ArrayLike) -> Array:
        """Return drive times (s) of sensor times (s)."""
        t = np.asarray(time, float)
        return np.asarray(self.delay + t + t * (self.skew + 0.5 * self.drift * t))

    def to_sensor(self, time: ArrayLike) -> Array:
        """Return sensor times (s) of drive times (s)."""
        s = np.asarray(time, float) - self.delay
        # the root of the quadratic in the form that loses no digits as the drift vanishes
        inside = self.ratio**2 + 2.0 * self.drift * s
        if np.any(inside <= 0.0):
            raise UnusableInput("time map: the drift turns time backwards within the record")
        return np.asarray(2.0 * s / (self.ratio + np.sqrt(inside)))
