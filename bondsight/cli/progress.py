"""A progress bar that says what is being tried."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable
from time import monotonic
from types import FrameType
from typing import Any

from tqdm import tqdm

from bondgraph.support.notice import Notice

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


PAUSE = 30.0
"""Seconds between two lines where no bar can be shown."""


class Bar:
    """Progress on standard error; where that is no terminal a line now and then.

    Parameters
    ----------
    quiet : bool
        Show nothing.
    """

    def __init__(self, quiet: bool = False) -> None:
        terminal = sys.stderr.isatty()
        self._bar = tqdm(
            total=100, disable=quiet or not terminal, file=sys.stderr, leave=False,
            bar_format="{l_bar}{bar}| {elapsed}", dynamic_ncols=True,
        )  # fmt: skip
        self._quiet, self._lines = quiet, not quiet and not terminal
        self._begin = self._last = monotonic()

    def __enter__(self) -> Bar:
        """Show the bar."""
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the bar."""
        self._bar.close()

    def __call__(self, text: str, fraction: float) -> None:
        """Move to `fraction` (0..1) and show `text`; a notice stays as a line of its own."""
        if isinstance(text, Notice):
            if not self._quiet:
                self._bar.write(f"suspect: {text}", file=sys.stderr)
                sys.stderr.flush()
            return
        self._bar.set_description_str(text[:48].ljust(48))
        self._bar.n = max(self._bar.n, round(100 * fraction))
        self._bar.refresh()
        now = monotonic()
        if self._lines and now - self._last >= PAUSE:
            self._last = now
            print(f"{now - self._begin:.0f} s: {text}", file=sys.stderr, flush=True)
