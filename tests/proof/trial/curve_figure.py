"""Curves of error against coverage, drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from identification.report.style import AFTER
from tests.proof.trial.curves import TOOL, Curve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (
    "#d97706", "#fbbf24", "#7c3aed", "#c084fc", "#15803d", "#65a30d", "#86c98f", "#b91c1c",
)  # fmt: skip
"""Colours of the baselines, kin to kin."""
HEIGHT = 4.2
"""Of the figure, inches."""


def draw_curves(curves: Sequence[Curve]) -> Figure:
    """Draw curves on a figure of their own; see `curves_on`."""
    from identification.report.canvas import drawing

    with drawing("curves", HEIGHT, paper=True) as canvas:
        curves_on(canvas.figure, curves)
        return canvas.figure  # type: ignore[no-any-return]


def curves_on(figure: Figure, curves: Sequence[Curve]) -> None:
    """Draw wrong names, and names where there is none to give, against coverage.

    The tool's default, which withholds nothing that it tells, is marked by a point with its exact
    95 % interval.
    """
    left, right = figure.subplots(1, 2)
    colours = iter(COLOURS)
    for c in curves:
        own = c.name == TOOL
        colour = AFTER if own else next(colours)
        for axes, points in ((left, c.points), (right, c.alarms)):
            if points:
                axes.step(
                    *zip(*points, strict=True), where="post", color=colour, label=c.name,
                    linewidth=2.0 if own else 1.0, zorder=3 if own else 2,
                )  # fmt: skip
        if own and c.counts[-1].wrong.total:
            _marked(left, c, colour)
            right.plot(*c.alarms[-1], "o", color=colour, markersize=5, zorder=4)
    left.set_ylabel("wrong names, of the names given")
    right.set_ylabel("given a name, of controls and physics outside")
    for axes in (left, right):
        axes.set_xlabel("named, of the recordings with an effect that has a name")
        axes.set_xlim(0, 1)
        axes.set_ylim(bottom=-0.02)
    left.legend(fontsize=6)


def _marked(axes: Axes, c: Curve, colour: str) -> None:
    (x, y), (low, high) = c.points[-1], c.counts[-1].wrong.exact
    axes.errorbar(
        [x], [y], yerr=[[max(y - low, 0)], [max(high - y, 0)]], fmt="o", color=colour,
        markersize=5, capsize=3, zorder=4,
    )  # fmt: skip
