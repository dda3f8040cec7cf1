"""The time of the program: real, or that of a virtual bench."""

from __future__ import annotations

import time
from typing import Protocol, final, runtime_checkable


@runtime_checkable
class Clock(Protocol):
    """A monotonic time of the program, in s from an arbitrary instant.

    Whatever waits, waits through its clock; so the same code runs in real time and on a virtual
    bench, where `sleep` makes the time pass.
    """

    def now(self) -> float:
        """Present time (s)."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait (s); nothing for zero and less."""
        ...


@final
class WallClock:
    """Time of the computer."""

    def now(self) -> float:
        """Present time (s)."""
        return time.perf_counter()

    def sleep(self, seconds: float) -> None:
        """Wait (s)."""
        if seconds > 0.0:
            time.sleep(seconds)
