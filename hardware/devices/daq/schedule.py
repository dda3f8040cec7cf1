"""When the samples of a software-timed waveform are due."""

from __future__ import annotations

import time
from collections import deque
from typing import final

from hardware.contracts import Clock, WallClock

_SPIN = 200e-6
_TOLERANCE = 1e-9
_RECENT = 16
"""Writes that tell what one takes: the quickest of them is no stall, and is soon forgotten."""


@final
class Schedule:
    """Instants ``start + k period``, none of which moves because another one was late.

    After a stall the samples that are due are not written in one burst, which would be a step for
    the actuator: two samples are never closer than ``period / haste``, so the schedule is caught up
    gradually and the waveform's slew exceeds the planned one by ``haste`` at most.

    Parameters
    ----------
    clock : Clock
        On a `WallClock` the last 200 us before an instant are waited for in a loop, because the
        system wakes a sleeper late.
    period : float
        s.
    haste : float
        How much faster than planned samples may follow each other, >= 1.
    """

    def __init__(self, clock: Clock, period: float, haste: float = 1.1) -> None:
        self._clock = clock
        self._spins = isinstance(clock, WallClock)
        self._period = period
        self._closest = period / haste
        self._start = 0.0
        self._last = float("-inf")
        self._took: deque[float] = deque(maxlen=_RECENT)

    @property
    def start(self) -> float:
        """Instant of sample 0 (s)."""
        return self._start

    def begin(self, lead: float) -> None:
        """Plan sample 0 for `lead` seconds from now."""
        self._start = self._clock.now() + lead
        self._last = float("-inf")
        self._took.clear()

    def slack(self, k: int) -> float:
        """Time (s) until sample `k` is due; negative behind it."""
        return self._start + k * self._period - self._clock.now()

    def wait(self, k: int) -> tuple[float, float]:
        """Wait for sample `k`; return how late (s) it is and the present instant (s)."""
        due = self._start + k * self._period
        now = self._until(max(due, self._last + self._closest))
        self._last = now
        return now - due, now

    def written(self) -> None:
        """Note that the sample waited for last was written: a stall may have come in between.

        What the quickest of the last writes took does not count, it is taken by the next one too.
        """
        took = max(self._clock.now() - self._last, 0.0)
        least = min(took, *self._took) if self._took else 0.0  # the first may be a stall itself
        self._took.append(took)
        self._last += took - least

    def _until(self, instant: float) -> float:
        now = self._clock.now()
        if self._spins:
            if instant - now > _SPIN:
                time.sleep(instant - now - _SPIN)
            # the clock's own function, without the way through the object
            read = time.perf_counter
            now = read()
            while now < instant:
                now = read()
            return now
        while now < instant - _TOLERANCE:
            self._clock.sleep(instant - now)
            now = self._clock.now()
        return now
