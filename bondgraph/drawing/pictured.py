"""The drawing of a graph as a matplotlib figure: the shapes of its SVG, one after the other."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np

from bondgraph.drawing.panels import Panels
from bondgraph.support.arrays import Array

PIXELS = 96.0
"""Of an SVG, in an inch."""
POINTS = 72.0 / PIXELS


def pictured(svg: str) -> Panels:
    """Return the axes that show an SVG of `bondgraph.drawing.svg`, shape (1,)."""
    from matplotlib.figure import Figure

    page = ElementTree.fromstring(svg)
    x, y, width, height = map(float, page.attrib["viewBox"].split())
    figure = Figure(figsize=(width / PIXELS, height / PIXELS))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set_xlim(x, x + width)
    ax.set_ylim(y + height, y)
    ax.set_axis_off()
    for order, shape in enumerate(page.iter()):
        _drawn(ax, shape, order)
    return Panels.of([ax])


def _drawn(ax: Any, shape: ElementTree.Element, order: int) -> None:
    from matplotlib.patches import FancyBboxPatch, Polygon

    held = shape.attrib
    style: dict[str, Any] = {
        "facecolor": held.get("fill", "none"), "edgecolor": held.get("stroke", "none"),
        "linewidth": POINTS * float(held.get("stroke-width", 0.0)), "zorder": order,
    }  # fmt: skip
    dashes = tuple(POINTS * float(v) for v in held.get("stroke-dasharray", "").split())
    match shape.tag.rpartition("}")[2]:
        case "rect":
            x, y, width, height, radius = (
                float(held.get(n, 0.0)) for n in ("x", "y", "width", "height", "rx")
            )
            round_ = f"round,pad=0,rounding_size={radius}"
            box = FancyBboxPatch((x, y), width, height, boxstyle=round_, **style)
            if dashes:  # matplotlib counts them in widths of the line
                box.set_linestyle((0, tuple(v / style["linewidth"] for v in dashes)))
            ax.add_patch(box)
        case "polygon":
            ax.add_patch(Polygon(_points(held["points"]), closed=True, **style))
        case "polyline":
            line = ax.plot(
                *_points(held["points"]).T, color=held["stroke"], lw=style["linewidth"],
                zorder=order, solid_joinstyle="round", solid_capstyle="round",
            )[0]  # fmt: skip
            if dashes:
                line.set_dashes(tuple(v / style["linewidth"] for v in dashes))
        case "text":
            ax.text(
                float(held["x"]), float(held["y"]), shape.text or "", color=held["fill"],
                fontsize=POINTS * float(held["font-size"]), ha="center", va="baseline",
                fontweight="bold" if "font-weight" in held else "normal", zorder=order,
                parse_math=False,
            )  # fmt: skip


def _points(text: str) -> Array:
    return np.array([[float(v) for v in pair.split(",")] for pair in text.split()])
