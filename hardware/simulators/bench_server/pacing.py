"""A bench in real time, for programs that wait by the clock of the computer."""

from __future__ import annotations

import threading
import time
from typing import final

from hardware.simulators.rig import Rig

_TICK = 2e-3


@final
class Pacer:
    """Lets the time of a bench follow the computer's.

    Every access to the bench sees the time at that moment; a thread beside it does what is due
    while nobody asks.

    Parameters
    ----------
    rig : Rig
        The bench.
    speed : float
        Seconds of the bench in a second of the computer.
    """

    def __init__(self, rig: Rig, speed: float = 1.0) -> None:
        self._rig = rig
        self._speed = speed
        self._end = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Let time pass from now on."""
        begin, origin = self._rig.now, time.perf_counter()
        self._rig.pace(lambda: begin + self._speed * (time.perf_counter() - origin))
        self._end.clear()
        self._thread = threading.Thread(target=self._run, daemon=True, name="pacer")
        self._thread.start()

    def stop(self) -> None:
        """Let time stand still; any number of times."""
        self._end.set()
        if self._thread is not None:
            self._thread.join(2.0)
            self._thread = None
            self._rig.pace(None)

    def _run(self) -> None:
        while not self._end.wait(_TICK):
            self._rig.follow()
