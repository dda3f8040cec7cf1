"""A figure with a row of panels, written without a display."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Draw: TypeAlias = "Callable[[Sequence[Axes]], None]"
"""Draws into the panels it is given."""


def save_figure(target: Path, panels: int, draw: Draw) -> Path:
    """Write `panels` panels side by side to `target`; returns the path."""
    from identification.report.canvas import drawing

    with drawing("ultrasonic", 3.6, 5.0 * panels, paper=True) as canvas:
        draw(canvas.rows(1, columns=panels)[0])
        canvas.figure.savefig(target, dpi=120)
    return target
