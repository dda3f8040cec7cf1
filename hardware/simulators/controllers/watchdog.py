"""An option of some devices: without commands for a while the output goes to its safe value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

from hardware.simulators.rig import Rig

_STEP = 1e-3


@dataclass(frozen=True, slots=True)
class CommandWatchdog:
    """How a device watches its program.

    Parameters
    ----------
    patience : float
        Longest silence (s, time of the bench).
    safe : float
        Where the output goes then (V).
    rate : float
        How fast it goes there (V/s).
    """

    patience: float
    safe: float = 0.0
    rate: float = 500.0


@final
class ArmedWatchdog:
    """A watchdog at work.

    Parameters
    ----------
    rig : Rig
        The bench, for its time.
    watchdog : CommandWatchdog
        Patience, safe value and rate.
    read, write : callable
        The output that is taken over (V).
    stop : callable
        Ends whatever else drives the output.
    """

    def __init__(
        self,
        rig: Rig,
        watchdog: CommandWatchdog,
        read: Callable[[], float],
        write: Callable[[float], None],
        stop: Callable[[], None],
    ) -> None:
        self._rig = rig
        self._watchdog = watchdog
        self._read = read
        self._write = write
        self._stop = stop
        self._last = rig.now
        self._armed = False
        self.bitten = False

    def pat(self) -> None:
        """Hear from the program."""
        self._last = self._rig.now
        self.bitten = False
        if not self._armed:
            self._armed = True
            self._rig.at(self._last + self._watchdog.patience, self._look)

    def _look(self) -> None:
        due = self._last + self._watchdog.patience
        if self._rig.now < due:
            self._rig.at(due, self._look)
            return
        self._armed = False
        self.bitten = True
        self._stop()
        self._ramp()

    def _ramp(self) -> None:
        if not self.bitten:
            return
        left = self._watchdog.safe - self._read()
        step = self._watchdog.rate * _STEP
        if abs(left) <= step:
            self._write(self._watchdog.safe)
            return
        self._write(self._read() + (step if left > 0.0 else -step))
        self._rig.at(self._rig.now + _STEP, self._ramp)
