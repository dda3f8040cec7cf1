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
    "": ("#eef0f2", "#3e4c59"),
}
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


def line(points: Sequence[Point], colour: str, width: float, dash: str = "") -> str:
    """Polyline."""
    dashed = f' stroke-dasharray="{dash}"' if dash else ""
    coordinates = " ".join(f"{number(x)},{number(y)}" for x, y in points)
    return (
        f'<polyline points="{coordinates}" fill="none" stroke="{colour}"'
        f' stroke-width="{number(width)}" stroke-linejoin="round" stroke-linecap="round"{dashed}/>'
    )


def element(label: Label, at: Point, domain: str, tip: str, ring: str = "") -> str:
    """Label of an element with its ring (``marked``, ``also`` or none)."""
    fill, ink = FILL.get(domain, FILL[""])
    body = label.body.shifted(*at)
    out = [f"<g><title>{escape(tip)}</title>"]
    if ring:
        colour = ACCENT if ring == "marked" else SECOND
        dash = "" if ring == "marked" else "5 3"
        tint = "#fff1e6" if ring == "marked" else "none"
        out.append(box(body.grown(3.0), tint, colour, 2.2 if ring == "marked" else 1.8, 10.0, dash))
    out.append(box(body, fill, "none", 0.0, 7.0))
    out.append(text((at[0], at[1] + 0.36 * label.size), label.text, label.size, ink, bold=True))
    if label.note:
        out.append(text((at[0], at[1] + label.note_at), label.note, SMALL, FAINT))
    if label.caption:
        colour = ACCENT if ring == "marked" else SECOND
        out.append(text((at[0], at[1] + label.caption_at), label.caption, SMALL, colour, bold=True))
    return "".join([*out, "</g>"])


def power_bond(points: Sequence[Point], stroke_at_head: bool | None, tip: str) -> str:
    """Bond with its half arrow; `stroke_at_head` None draws no causal stroke."""
    out = [f'<g class="bond"><title>{escape(tip)}</title>', line(points, INK, 1.7)]
    u, n = _frame(points[-2], points[-1])
    x, y = points[-1]
    side = _barb_side(n)
    barb = (x - _HEAD * u[0] + side * _SPREAD * n[0], y - _HEAD * u[1] + side * _SPREAD * n[1])
    out.append(line((points[-1], barb), INK, 1.7))
    if stroke_at_head is not None:
        p, q = (points[-1], points[-2]) if stroke_at_head else (points[0], points[1])
        _, n = _frame(q, p)
        a = (p[0] + _STROKE * n[0], p[1] + _STROKE * n[1])
        b = (p[0] - _STROKE * n[0], p[1] - _STROKE * n[1])
        out.append(line((a, b), INK, 2.4).replace("<polyline ", '<polyline class="stroke" '))
    return "".join([*out, "</g>"])


def tap(points: Sequence[Point]) -> str:
    """Dashed line with a full arrow head: a signal, no power."""
    u, n = _frame(points[-2], points[-1])
    x, y = points[-1]
    back = (x - 9.0 * u[0], y - 9.0 * u[1])
    a = (back[0] + 4.2 * n[0], back[1] + 4.2 * n[1])
    b = (back[0] - 4.2 * n[0], back[1] - 4.2 * n[1])
    head = " ".join(f"{number(p[0])},{number(p[1])}" for p in (points[-1], a, b))
    shaft = line((*points[:-1], back), FAINT, 1.3, "5 4")
    return f'<g class="tap">{shaft}<polygon points="{head}" fill="{FAINT}"/></g>'


def _frame(a: Point, b: Point) -> tuple[Point, Point]:
    """Return the unit vector from a to b and its normal."""
    d = hypot(b[0] - a[0], b[1] - a[1]) or 1.0
    u = ((b[0] - a[0]) / d, (b[1] - a[1]) / d)
    return u, (-u[1], u[0])


def _barb_side(n: Point) -> float:
    """Hang the half arrow below level bonds and to the right of upright ones."""
    if abs(n[1]) > abs(n[0]) * 0.5:
        return 1.0 if n[1] > 0 else -1.0
    return 1.0 if n[0] > 0 else -1.0
