"""Held tones and their harmonics in closed form: no filter runs, any instant."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self, final

import numpy as np

from bondgraph.support.arrays import FloatArray as Array


@final
@dataclass(frozen=True, slots=True)
class Toned:
    """Cosine and sine of a frequency and its multiples, held in steps, behind a lag.

    In the steady state a held ``exp(i w k T)`` behind a lag is ``exp(i w k T) (1 + (a - 1) e)``
    with ``e = exp(-p / lag)`` at the time ``p`` since the step began and
    ``a = (1 - E) / (exp(i w T) - E)``, ``E = exp(-T / lag)``. Joined by straight lines instead,
    the tone itself is taken, which no more than turns and scales it.

    Parameters
    ----------
    frequency : float
        Hz.
    orders : int
        Number of harmonics, the first included.
    step : float
        T (s).
    steps : bool
        Whether the samples are held (or joined by lines).
    lag : float
        s.
    """

    frequency: float
    orders: int
    step: float
    steps: bool = True
    lag: float = 0.0

    @property
    def count(self) -> int:
        """Number of columns."""
        return 2 * self.orders

    def with_lag(self, lag: float) -> Self:
        """Return the same behind another lag (s)."""
        return replace(self, lag=lag)

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return values and their slopes in time at instants (s), both (n, 2 orders)."""
        w = 2.0 * np.pi * self.frequency
        k = np.floor(time / self.step)
        begun = self.step * k if self.steps else time
        turn = np.exp(1j * w * begun)
        values = np.empty((time.size, self.count))
        slopes = np.zeros((time.size, self.count))
        e = np.exp(-(time - begun) / self.lag) if self.steps and self.lag > 0.0 else None
        wave = np.ones_like(turn)
        for h in range(1, self.orders + 1):
            wave = wave * turn
            value, slope = wave, None if self.steps else 1j * w * h * wave
            if e is not None:
                rest = wave * ((self._state(w * h) - 1.0) * e)
                value, slope = wave + rest, rest / -self.lag
            values[:, 2 * h - 2], values[:, 2 * h - 1] = value.real, value.imag
            if slope is not None:
                slopes[:, 2 * h - 2], slopes[:, 2 * h - 1] = slope.real, slope.imag
        return values, slopes

    def _state(self, w: float) -> complex:
        """Return a: the output at the beginning of a step over the value held in it."""
        decay = np.exp(-self.step / self.lag)
        return complex((1.0 - decay) / (np.exp(1j * w * self.step) - decay))
