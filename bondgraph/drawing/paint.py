"""SVG text of labels, bonds, half arrows and causal strokes."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from math import hypot

from bondgraph.drawing.geometry import Point, Rect
from bondgraph.drawing.labels import SMALL, Label

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
INK, FAINT, ACCENT, SECOND = "#1f2933", "#52606d", "#c2410c", "#6d28d9"
FILL = {
    "electrical": ("#e3effb", "#1d4f8c"),
    "mechanical": ("#e6f4e4", "#2b6127"),
    "thermal": ("#fde8e0", "#9a3412"),
    "hydraulic": ("#e0f4f4", "#155e63"),
    "chemical": ("#f3e8fb", "#6b2a8f"),
    "": ("#eef0f2", "#3e4c59"),
}
STROKES = {"": INK, "derivative": "#be123c", "free": "#0369a1"}
_HEAD, _SPREAD, _STROKE = 11.0, 6.0, 8.0


def number(v: float) -> str:
    """Short text of a coordinate."""
    return f"{v:z.1f}".removesuffix(".0")


def text(p: Point, content: str, size: float, colour: str, *, bold: bool = False) -> str:
    """Centred text with its base line at `p`."""
    weight = ' font-weight="600"' if bold else ""
    return (
        f'<text x="{number(p[0])}" y="{number(p[1])}" font-size="{number(size)}" fill="{colour}"'
        f' text-anchor="middle"{weight}>{escape(content)}</text>'
    )


def box(r: Rect, fill: str, stroke: str, width: float, radius: float, dash: str = "") -> str:
    """Draw a rounded rectangle."""
    dashed = f' stroke-dasharray="{dash}"' if dash else ""
    return (
        f'<rect x="{number(r.x0)}" y="{number(r.y0)}" width="{number(r.width)}"'
        f' height="{number(r.height)}" rx="{number(radius)}" fill="{fill}" stroke="{stroke}"'
        f' stroke-width="{number(width)}"{dashed}/>'
    )


def line(points: Sequence[Point], colour: str, width: float, dash: str = "", kind: str = "") -> str:
    """Polyline; `kind` becomes its class."""
    named = f'class="{kind}" ' if kind else ""
    dashed = f' stroke-dasharray="{dash}"' if dash else ""
    coordinates = " ".join(f"{number(x)},{number(y)}" for x, y in points)
    return (
        f'<polyline {named}points="{coordinates}" fill="none" stroke="{colour}"'
        f' stroke-width="{number(width)}" stroke-linejoin="round" stroke-linecap="round"{dashed}/>'
    )


def element(
    label: Label,
    at: Point,
    domain: str,
    tip: str,
    ring: str = "",
    *,
    off: bool = False,
    fill: str = "",
    name: str = "",
) -> str:
    """Label of an element with its ring (``marked``, ``also`` or none); `off` dots its outline.

    `fill` replaces the colour of the domain; by `name` a page finds the element.
    """
    usual, ink = FILL.get(domain, FILL[""])
    fill = fill or usual
    body = label.body.shifted(*at)
    out = [f'<g class="element" data-name="{escape(name)}"><title>{escape(tip)}</title>']
    if ring:
        colour = ACCENT if ring == "marked" else SECOND
        dash = "" if ring == "marked" else "5 3"
        tint = "#fff1e6" if ring == "marked" else "none"
        out.append(box(body.grown(3.0), tint, colour, 2.2 if ring == "marked" else 1.8, 10.0, dash))
    out.append(
        box(body, "#ffffff", ink, 1.3, 7.0, "2 3") if off else box(body, fill, "none", 0.0, 7.0)
    )
    out.append(text((at[0], at[1] + 0.36 * label.size), label.text, label.size, ink, bold=True))
    if label.note:
        out.append(text((at[0], at[1] + label.note_at), label.note, SMALL, FAINT))
    if label.caption:
        colour = ACCENT if ring == "marked" else SECOND
        out.append(text((at[0], at[1] + label.caption_at), label.caption, SMALL, colour, bold=True))
    return "".join([*out, "</g>"])


def power_bond(
    points: Sequence[Point],
    stroke_at_head: bool | None,
    tip: str,
    colour: str = INK,
    ends: tuple[str, str] = ("", ""),
) -> str:
    """Bond with its half arrow; `stroke_at_head` None draws no causal stroke.

    By the names at its `ends` a page finds the bond.
    """
    tail, head = map(escape, ends)
    out = [
        f'<g class="bond" data-tail="{tail}" data-head="{head}"><title>{escape(tip)}</title>',
        line(points, INK, 1.7),
    ]
    u, n = _frame(points[-2], points[-1])
    x, y = points[-1]
    side = _barb_side(u, n)
    barb = (x - _HEAD * u[0] + side * _SPREAD * n[0], y - _HEAD * u[1] + side * _SPREAD * n[1])
    out.append(line((points[-1], barb), INK, 1.7, kind="half-arrow"))
    if stroke_at_head is not None:
        p, q = (points[-1], points[-2]) if stroke_at_head else (points[0], points[1])
        out.append(causal_stroke(p, q, colour))
    return "".join([*out, "</g>"])


def causal_stroke(at: Point, towards: Point, colour: str) -> str:
    """Stroke at the end of a line that comes from `towards`."""
    _, n = _frame(towards, at)
    a = (at[0] + _STROKE * n[0], at[1] + _STROKE * n[1])
    b = (at[0] - _STROKE * n[0], at[1] - _STROKE * n[1])
    return line((a, b), colour, 2.4 if colour == INK else 3.0, kind="stroke")


def tap(points: Sequence[Point], tip: str) -> str:
    """Dashed line with a full arrow head: a sensor, no power."""
    return _arrow(points, tip, "tap", 1.3, "5 4", 9.0)


def signal(points: Sequence[Point], tip: str) -> str:
    """Thin dashed line with a small full arrow head: a signal that modulates an element."""
    return _arrow(points, tip, "signal", 1.0, "3 3", 7.0)


def _arrow(
    points: Sequence[Point], tip: str, kind: str, width: float, dash: str, size: float
) -> str:
    u, n = _frame(points[-2], points[-1])
    x, y = points[-1]
    back = (x - size * u[0], y - size * u[1])
    half = 0.46 * size
    a = (back[0] + half * n[0], back[1] + half * n[1])
    b = (back[0] - half * n[0], back[1] - half * n[1])
    head = " ".join(f"{number(p[0])},{number(p[1])}" for p in (points[-1], a, b))
    shaft = line((*points[:-1], back), FAINT, width, dash)
    return (
        f'<g class="{kind}"><title>{escape(tip)}</title>{shaft}'
        f'<polygon points="{head}" fill="{FAINT}"/></g>'
    )


def _frame(a: Point, b: Point) -> tuple[Point, Point]:
    """Return the unit vector from a to b and its normal."""
    d = hypot(b[0] - a[0], b[1] - a[1]) or 1.0
    u = ((b[0] - a[0]) / d, (b[1] - a[1]) / d)
    return u, (-u[1], u[0])


def _barb_side(u: Point, n: Point) -> float:
    """Hang the half arrow below level bonds, to the right of upright ones, inside slanting ones."""
    if abs(u[0]) > 0.98:
        return 1.0 if n[1] > 0 else -1.0
    if abs(u[1]) > 0.98:
        return 1.0 if n[0] > 0 else -1.0
    return 1.0 if n[1] * u[1] < 0 else -1.0  # the steeper one: the other lies along the label
