"""Figures as files, in the style of the report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from bondgraph.support.errors import UnusableInput
from bondsight.cli.output import writable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES = (".svg", ".png", ".pdf", ".eps", ".jpg", "")
"""Endings; without one it is a .png."""


def require_figure(path: Path) -> None:
    """Refuse a file whose ending is none of a figure, before anything is computed.

    Raises
    ------
    UnusableInput
        It has another ending.
    """
    if path.suffix.lower() not in FIGURES:
        raise UnusableInput(
            f"--out {path}: a figure ends in {', '.join(FIGURES[:-2])} or {FIGURES[-2]}"
        )


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

    require_figure(path)
    writable(path.parent)
    with mpl.rc_context({**PLOT, "svg.hashsalt": "figure"}):
        figure = draw()
        if path.suffix.lower() == ".svg":
            write_atomically(path, inline(figure, "figure") + "\n")
        else:
            with replacing(path) as stream:
                figure.savefig(stream, format=path.suffix[1:].lower() or "png", dpi="figure")
    return path
