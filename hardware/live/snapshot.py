"""The live view as a picture, rewritten whole every second."""

from __future__ import annotations

import textwrap
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, final

import numpy as np

from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.whole_file import regular_target, replacing
from hardware.live.state import ChannelState, LiveState, StreamState
from hardware.live.text import one_line

_SHOWN = ("x", "V", "F", "V_mon", "i")
_MAX_PANELS = 4
_EVERY = 1.0
"""Real time from picture to picture (s)."""


@final
class Snapshot:
    """Draws the newest state into a PNG file, in a thread beside the acquisition.

    A viewer that reloads the file never sees half a picture. States that come while one is being
    drawn are skipped.

    Parameters
    ----------
    path : path
        The file, ending in .png.

    Raises
    ------
    UnusableInput
        The ending is another, the folder is not there, or the place is taken by no regular file.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        if self._path.suffix.lower() != ".png":
            raise UnusableInput(f"{path}: the live picture is a .png; give such a name")
        if not self._path.parent.is_dir():
            raise UnusableInput(f"{self._path.parent}: there is no such folder; make it first")
        regular_target(self._path)
        self._newest: LiveState | None = None
        self._wake = threading.Event()
        self._ended = threading.Event()
        self._next = 0.0
        self.error = ""
        """Why the last picture was not written; empty if it was."""
        self._thread = threading.Thread(target=self._run, name="live-picture", daemon=True)
        self._thread.start()

    @property
    def due(self) -> bool:
        """Whether it is time for the next picture."""
        return time.monotonic() >= self._next

    def show(self, state: LiveState) -> None:
        """Hand over a state; costs nothing unless it is time."""
        if self.due or state.ended:
            self._next = time.monotonic() + _EVERY
            self._newest = state
            self._wake.set()

    def close(self, timeout: float = 10.0) -> None:
        """Draw the last state handed over and end; any number of times, never hangs."""
        self._ended.set()
        self._wake.set()
        self._thread.join(timeout)

    def _run(self) -> None:
        ended = False
        while not ended:
            self._wake.wait()
            self._wake.clear()
            ended = self._ended.is_set()
            state, self._newest = self._newest, None
            if state is None:
                continue
            try:
                draw(state, self._path)
                self.error = ""
            except (BondsightError, OSError, ValueError, RuntimeError) as error:
                # a picture is never worth a measurement
                self.error = str(error)


def draw(state: LiveState, path: Path) -> None:
    """Draw a state into a PNG file, all or nothing.

    Raises
    ------
    UnusableInput
        The file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    found = [(s, c) for s in state.streams for c in s.channels]
    shown = sorted((f for f in found if f[1].name in _SHOWN), key=lambda f: _order(f[1].name))
    shown = (shown or found)[:_MAX_PANELS]
    height = 1.4 + 1.8 * max(1, len(shown))
    figure = Figure(figsize=(8.0, height))
    # fixed margins: a layout that is computed costs four times the drawing
    turning = [pair for stream in state.streams for pair in _quadrature(stream)]
    right = 0.66 if turning else 0.97
    figure.subplots_adjust(0.11, 0.3 / height, right, 1.0 - 1.3 / height, hspace=0.35)
    FigureCanvasAgg(figure)
    for cosine, sine in turning[:1]:
        _lissajous(figure.add_axes((0.73, 0.3 / height, 0.25, 2.0 / height)), cosine, sine)
    panels: Any = figure.subplots(max(1, len(shown)), 1, squeeze=False)[:, 0]
    for panel, (s, c) in zip(panels, shown, strict=False):
        panel.plot(np.arange(c.recent.size) - c.recent.size + 1, c.recent, linewidth=1.0)
        panel.set_ylabel(f"{c.name} [{c.unit}]")
        panel.set_title(f"{s.name}: {s.samples} samples", fontsize=8, loc="left")
        panel.grid(alpha=0.3)
        panel.tick_params(labelbottom=False)
    warnings = [f"! {w}" for w in state.warnings[-3:]]
    parts = [line for part in [*warnings, one_line(state)] for line in textwrap.wrap(part, 100)]
    text = "\n".join(parts[:5])
    # names and warnings are no formulas
    figure.suptitle(
        text.replace("$", r"\$"), fontsize=9, color="firebrick" if warnings else "black"
    )
    with replacing(path) as stream:
        figure.savefig(stream, format="png", dpi=90)


def _quadrature(stream: StreamState) -> Iterator[tuple[ChannelState, ChannelState]]:
    """Yield cosine and sine of an interferometer that tells them."""
    by_name = {c.name: c for c in stream.channels}
    if {"cos", "sin"} <= set(by_name):
        yield by_name["cos"], by_name["sin"]


def _lissajous(panel: Any, cosine: ChannelState, sine: ChannelState) -> None:
    """Draw the newest of the two signals over each other: a circle where the head is adjusted."""
    panel.plot(cosine.recent, sine.recent, ".", markersize=2.0)
    # all so far, so that the axes do not move with every picture
    reach = 1.1 * max(abs(v) for c in (cosine, sine) for v in (c.low, c.high, 1e-300))
    if np.isfinite(reach):
        panel.set(xlim=(-reach, reach), ylim=(-reach, reach))
    panel.set_aspect("equal")
    panel.set_title("cos, sin", fontsize=8, loc="left")
    panel.grid(alpha=0.3)
    panel.tick_params(labelsize=7)


def _order(name: str) -> int:
    return _SHOWN.index(name)
