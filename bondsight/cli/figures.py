"""Figures as files: SVG in the style of the report, other formats as they are."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from bondsight.cli.output import writable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save_figure(path: Path, draw: Callable[[], Figure]) -> Path:
    """Draw and write a figure, whole or not at all; returns `path`.

    Parameters
    ----------
    path : Path
        Its ending says the format; missing folders are made.
    draw : callable
        Returns the figure.
    """
    import matplotlib as mpl

    from bondgraph.support.whole_file import replacing, write_atomically
    from identification.report.canvas import inline
    from identification.report.style import PLOT

    writable(path.parent)
    if path.suffix.lower() == ".svg":
        with mpl.rc_context({**PLOT, "svg.hashsalt": "figure"}):
            write_atomically(path, inline(draw(), "figure") + "\n")
        return path
    figure = draw()
    with replacing(path) as stream:
        figure.savefig(stream, format=path.suffix[1:] or "png", dpi="figure")
    return path
