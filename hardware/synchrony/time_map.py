"""Time of the drive over time of the sensor: a start, a ratio and its changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True, slots=True)
class TimeMap:
    """What the drive's clock reads when the sensor's clock reads ``t``.

    ``s(t) = delay + t + skew t + drift t^2 / 2 + sum_j change_j max(t - t_j, 0)^2 / 2``, both
    clocks counted in nominal seconds from the first sample of their own stream: the ratio is a
    line over time, or several that meet.

    Parameters
    ----------
    delay : float
        The first sensor sample is taken so much after the first sample of the drive (s).
    skew : float
        Ratio of the clocks less one, at the start: 1e-6 is one part per million.
    drift : float
        Change of the ratio in a second (1/s), at the start.
    bends : tuple of (float, float)
        Instants ``t_j`` (s) at which the drift changes, and by how much (1/s).

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
    bends: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not np.isfinite([*self.numbers, *(t for t, _ in self.bends)]).all():
            raise UnusableInput(f"time map: {self} is not finite")
        if self.skew <= -1.0:
            raise UnusableInput(f"time map: skew {self.skew:g} lets time run backwards")

    @property
    def ratio(self) -> float:
        """Seconds of the drive's clock in one of the sensor's, at the start."""
        return 1.0 + self.skew

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers."""
        return ("delay", "skew", "drift", *(f"bend {j}" for j in range(len(self.bends))))

    @property
    def numbers(self) -> Array:
        """Delay, skew, drift and the changes of the drift, ``(3 + bends,)``."""
        return np.array([self.delay, self.skew, self.drift, *(change for _, change in self.bends)])

    def moved(self, by: Mapping[str, float]) -> TimeMap:
        """Return the map with some of the numbers, by name, larger by as much."""
        delay, skew, drift, *changes = (
            float(v) + by.get(n, 0.0) for n, v in zip(self.names, self.numbers, strict=True)
        )
        bends = zip((t for t, _ in self.bends), changes, strict=True)
        return TimeMap(delay, skew, drift, tuple(bends))

    def columns(self, time: ArrayLike) -> Array:
        """Return how drive time hangs on each of the numbers, ``(..., 3 + bends)``."""
        t = np.asarray(time, float)
        late = [0.5 * np.maximum(t - at, 0.0) ** 2 for at, _ in self.bends]
        return np.stack([np.ones_like(t), t, 0.5 * t * t, *late], axis=-1)

    def rates(self, time: ArrayLike) -> Array:
        """Return how the ratio hangs on each of the numbers, ``(..., 3 + bends)``."""
        t = np.asarray(time, float)
        late = [np.maximum(t - at, 0.0) for at, _ in self.bends]
        return np.stack([np.zeros_like(t), np.ones_like(t), t, *late], axis=-1)

    def skew_at(self, time: ArrayLike) -> Array:
        """Return the ratio less one at sensor times (s)."""
        return np.asarray(self.rates(time) @ self.numbers)

    def to_drive(self, time: ArrayLike) -> Array:
        """Return drive times (s) of sensor times (s)."""
        t = np.asarray(time, float)
        straight = self.delay + t + t * (self.skew + 0.5 * self.drift * t)
        bent = [0.5 * change * np.maximum(t - at, 0.0) ** 2 for at, change in self.bends]
        return np.asarray(sum(bent, straight))

    def to_sensor(self, time: ArrayLike) -> Array:
        """Return sensor times (s) of drive times (s)."""
        if self.bends:
            return self._inverted(np.asarray(time, float))
        s = np.asarray(time, float) - self.delay
        # the root of the quadratic in the form that loses no digits as the drift vanishes
        inside = self.ratio**2 + 2.0 * self.drift * s
        if np.any(inside <= 0.0):
            raise UnusableInput("time map: the drift turns time backwards within the record")
        return np.asarray(2.0 * s / (self.ratio + np.sqrt(inside)))

    def _inverted(self, wanted: Array) -> Array:
        t = wanted - self.delay
        # a contraction by the ratio error: three digits or more a step
        for _ in range(60):
            if np.any(self.skew_at(t) <= -1.0):
                break
            step = wanted - self.to_drive(t)
            t = t + step
            if float(np.abs(step).max(initial=0.0)) < 1e-15 * (1.0 + float(np.abs(t).max())):
                return np.asarray(t)
        raise UnusableInput("time map: the drift turns time backwards within the record")
