"""The live view on a terminal, in a pipe, or not at all."""

from __future__ import annotations

import shutil
import sys
import time
from typing import TextIO, final

from hardware.live.state import LiveState
from hardware.live.text import one_line, printable, render

_MAX_LINES = 40


@final
class LiveView:
    """Prints states: in place on a terminal, a plain line now and then elsewhere.

    Parameters
    ----------
    stream : text file, optional
        Where to; stderr by default, so that results can be piped.
    quiet : bool
        Print nothing.
    every, plain_every : float
        s of real time between two prints on a terminal, and elsewhere; warnings come at once.
    """

    def __init__(
        self,
        stream: TextIO | None = None,
        *,
        quiet: bool = False,
        every: float = 0.2,
        plain_every: float = 5.0,
    ) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._quiet = quiet
        self._terminal = not quiet and self._stream.isatty()
        self._every = every if self._terminal else plain_every
        self._blocks = _can_encode(self._stream)
        self._next = 0.0
        self._lines = 0
        self._warned: set[str] = set()

    @property
    def due(self) -> bool:
        """Whether it is time for the next print; lets the caller spare making a state."""
        return not self._quiet and time.monotonic() >= self._next

    def show(self, state: LiveState) -> None:
        """Print a state if it is time to, or if it is over, or warns of something new."""
        if self._quiet:
            return
        fresh = [w for w in state.warnings if w not in self._warned]
        if not (fresh or state.ended or self.due):
            return
        self._next = time.monotonic() + self._every
        self._warned.update(fresh)
        try:
            if self._terminal:
                self._in_place(state)
            else:
                text = [f"! {printable(w)}" for w in fresh] + [one_line(state)]
                self._stream.write("\n".join(text) + "\n")
            self._stream.flush()
        except (OSError, ValueError):
            # a terminal that was closed must not end a measurement
            self._quiet = True

    def _in_place(self, state: LiveState) -> None:
        columns, rows = shutil.get_terminal_size()
        # the last column stays free, some terminals wrap there
        lines = render(state, columns - 1, blocks=self._blocks)[: min(_MAX_LINES, rows - 1)]
        back = f"\x1b[{self._lines}F" if self._lines else ""
        body = "".join(f"\x1b[2K{line}\n" for line in lines)
        self._stream.write(f"{back}{body}\x1b[J")
        self._lines = len(lines)
        if state.ended:
            self._lines = 0


def _can_encode(stream: TextIO) -> bool:
    try:
        "\u2581\u2588".encode(getattr(stream, "encoding", None) or "ascii")
    except (UnicodeError, LookupError):
        return False
    return True
