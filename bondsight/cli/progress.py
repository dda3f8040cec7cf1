"""A progress bar that says what is being tried."""

from __future__ import annotations

import sys
from time import monotonic

from tqdm import tqdm

from bondgraph.support.notice import Notice

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
        self._told: set[str] = set()

    def __enter__(self) -> Bar:
        """Show the bar."""
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the bar."""
        self._bar.close()

    def __call__(self, text: str, fraction: float) -> None:
        """Move to `fraction` (0..1) and show `text`; a notice stays as a line of its own."""
        if isinstance(text, Notice):
            if not self._quiet and text not in self._told:  # a second search says it again
                self._told.add(text)
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
