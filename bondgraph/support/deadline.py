"""A search that ends once its time is over."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from time import monotonic
from types import FrameType
from typing import Any

SEARCHED = 0.9
"""Fraction of a diagnosis from which on it only writes up what it has."""


class Deadline:
    """Progress that ends a search by KeyboardInterrupt once its seconds are over.

    Within its block an alarm rings then, whatever is computed: a fit, a screening, a wait for
    others. Where there is none (another thread than the main one, Windows) every word of progress
    looks at the clock.

    Parameters
    ----------
    end : float or None
        Of `time.monotonic`.
    """

    def __init__(self, shown: Callable[[str, float], None], end: float | None) -> None:
        self._shown, self._end = shown, end
        self._before: Any = None
        self._searching = True
        self.over = False

    def __enter__(self) -> Deadline:
        """Set the alarm."""
        main = threading.current_thread() is threading.main_thread()
        if self._end is not None and main and hasattr(signal, "setitimer"):
            self._before = signal.signal(signal.SIGALRM, self._rung)
            signal.setitimer(signal.ITIMER_REAL, max(self._end - monotonic(), SOON))
        return self

    def __exit__(self, *_: object) -> None:
        """Take the alarm back."""
        if self._before is not None:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, self._before)

    def _rung(self, number: int, frame: FrameType | None) -> None:
        if self._searching:
            self.over = True
            raise KeyboardInterrupt

    def __call__(self, text: str, fraction: float) -> None:
        """Show, and end if it is time."""
        self._searching = fraction < SEARCHED
        self._shown(text, fraction)
        if self._searching and self._end is not None and monotonic() > self._end:
            self.over = True
            raise KeyboardInterrupt


SOON = 1e-3
"""Seconds to an alarm whose time is over; zero would take it back."""
