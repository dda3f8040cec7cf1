"""A dead time on a grid of steps, carried from call to call."""

from __future__ import annotations

from typing import final

import numpy as np

from hardware.simulators.arrays import Array


@final
class DelayLine:
    """Delays by a fixed number of steps, which need not be whole (cubic between steps).

    Parameters
    ----------
    steps : float
        Delay (steps), 0 or more.
    rest : float
        What came before the first value.
    """

    def __init__(self, steps: float, rest: float) -> None:
        whole = int(steps)
        s = 1.0 - (steps - whole)  # from the older value to the newer one
        self._weights: tuple[float, ...] = (0.0, 1.0 - s, s)
        if whole:
            self._weights = (
                -s * (s - 1.0) * (s - 2.0) / 6.0,
                (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
                -(s + 1.0) * s * (s - 2.0) / 2.0,
                (s + 1.0) * s * (s - 1.0) / 6.0,
            )
        self._kept = np.full(whole + 2 if steps else 0, rest)

    def pass_on(self, values: Array) -> Array:
        """Take values in and give the late ones out, ``(n,)``."""
        kept = self._kept.size
        if not kept:
            return values
        joined = np.concatenate([self._kept, values])
        self._kept = joined[joined.size - kept :].copy()
        n = values.size
        return np.asarray(sum(w * joined[k : k + n] for k, w in enumerate(self._weights)))

    def snapshot(self) -> Array:
        """Return what is kept."""
        return self._kept

    def restore(self, kept: Array) -> None:
        """Put back what was kept."""
        self._kept = kept
