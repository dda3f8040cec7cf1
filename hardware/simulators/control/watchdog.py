"""What the output of a simulated device does when its program is gone."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from hardware.simulators.rig import Rig


@dataclass(frozen=True, slots=True)
class ConnectionWatchdog:
    """A device that brings its output to 0 V when nobody talks to it any more.

    Parameters
    ----------
    timeout : float
        Silence after which it acts (s).
    fall : float
        Time of the way to 0 V (s).
    steps : int
        Steps of that way.
    """

    timeout: float = 0.5
    fall: float = 0.05
    steps: int = 50

    def __post_init__(self) -> None:
        """Refuse times that are no times."""
        for name in ("timeout", "fall"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"Watchdog: {name} = {value!r} must be finite and >= 0")
        if self.steps < 1:
            raise ValueError(f"Watchdog: steps = {self.steps} must be at least 1")

    def expire(
        self,
        rig: Rig,
        wanted: Callable[[], bool],
        drive: Callable[[float], None] | None = None,
    ) -> None:
        """Ask for the way to 0 V after the silence, if it is still `wanted` then.

        `drive` sets the voltage of the device that is watched (V); by default the terminals.
        """
        put = rig.drive if drive is None else drive
        with rig.lock:
            # the very instants: a sum in another order may end before the last step
            begin = rig.now + self.timeout
            end = begin + self.fall

            def act() -> None:
                if not wanted():
                    return
                high = rig.volts
                for k in range(1, self.steps):
                    part = k / self.steps
                    rig.at(begin + part * self.fall, lambda v=high * (1.0 - part): put(v))  # type: ignore[misc]
                rig.at(end, lambda: put(0.0))

            rig.at(begin, act)
            rig.wait_until(end)
