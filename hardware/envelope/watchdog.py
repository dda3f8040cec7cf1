"""Signs of life for a device that parks itself without them."""

from __future__ import annotations

from typing import Protocol, final, runtime_checkable

from bondgraph.support.errors import UnusableInput
from hardware.contracts import RawOutput


@runtime_checkable
class Fed(Protocol):
    """A raw output whose watchdog wants to be fed; beside `RawOutput`."""

    @property
    def watchdog_timeout(self) -> float:
        """Silence after which the device parks itself (s)."""
        ...

    def feed_watchdog(self) -> None:
        """Give a sign of life; `LinkLost` if it did not arrive."""
        ...


@final
class Heartbeat:
    """When to feed a watchdog, and whether it must have bitten already.

    There is no thread behind it, on purpose: a thread would go on feeding for a program that
    hangs. Whoever drives the output calls `GuardedOutput.tend` in its loop.

    Parameters
    ----------
    raw : RawOutput
        Fed if it has a watchdog and is `Fed`; otherwise nothing happens here.
    """

    __slots__ = ("_fed", "_last", "_period", "_timeout")

    def __init__(self, raw: RawOutput) -> None:
        self._fed: Fed | None = raw if raw.has_watchdog and isinstance(raw, Fed) else None
        self._timeout = 0.0 if self._fed is None else float(self._fed.watchdog_timeout)
        if self._fed is not None and not self._timeout > 0.0:
            raise UnusableInput(f"watchdog: a time of {self._timeout} s; it must be positive")
        self._period = self._timeout / 3.0
        self._last: float | None = None

    @property
    def timeout(self) -> float | None:
        """Time of the device (s); None without a watchdog to feed."""
        return None if self._fed is None else self._timeout

    def bitten(self, now: float) -> bool:
        """Whether the silence until `now` (s) was longer than the device waits.

        After a clock that was set back nobody knows; then it counts as longer.
        """
        return (
            self._fed is not None
            and self._last is not None
            and not (0.0 <= now - self._last <= self._timeout)
        )

    def beat(self, now: float) -> None:
        """Feed if it is due at `now` (s)."""
        if self._fed is None:
            return
        if self._last is None or not 0.0 <= now - self._last < self._period:
            self._fed.feed_watchdog()
            self._last = now

    def reset(self, now: float) -> None:
        """Begin anew after a power-up at `now` (s)."""
        self._last = None
        self.beat(now)
