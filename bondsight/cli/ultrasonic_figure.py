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
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0 * panels, 3.6), layout="constrained")
    axes = [figure.add_subplot(1, panels, i + 1) for i in range(panels)]
    draw(axes)
    for a in axes:
        a.grid(alpha=0.3)
    figure.savefig(target, dpi=120)
    return target
