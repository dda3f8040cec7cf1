"""Heading and legend under a drawing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from bondgraph.drawing import paint
from bondgraph.drawing.geometry import Point, Rect
from bondgraph.drawing.labels import SMALL, text_width

_TITLE, _EDGE, _SAMPLE, _LINE = 16.0, 24.0, 20.0, 18.0
_STROKE_TEXT = {"derivative": "derivative causality", "free": "causality chosen freely"}


@dataclass(frozen=True, slots=True)
class LegendEntry:
    """A line of the legend: what it says, in which colour, and its sample at a point."""

    text: str
    colour: str
    sample: Callable[[Point], str]

    @property
    def width(self) -> float:
        """Room for sample, text and gap."""
        return _SAMPLE + text_width(self.text, SMALL) + 20.0


def entries(domains: Iterable[str], strokes: Iterable[str], *, signals: bool) -> list[LegendEntry]:
    """Return the entries for the domains, the kinds of strokes and the signals of a drawing."""
    present, kinds = set(domains), set(strokes)
    found = []
    shown = [d for d in paint.FILL if d and d in present]
    for d in shown if len(shown) > 1 else ():
        fill, ink = paint.FILL[d]
        found.append(LegendEntry(d, ink, partial(_patch, fill=fill, ink=ink)))
    for kind, text in _STROKE_TEXT.items():
        if kind in kinds:
            colour = paint.STROKES[kind]
            found.append(LegendEntry(text, colour, partial(_end, colour=colour)))
    if signals:
        found.append(LegendEntry("signal", paint.FAINT, _dashes))
    return found


def framed(page: Rect, title: str | None, lines: list[LegendEntry]) -> tuple[Rect, list[str]]:
    """Return the page grown by heading and legend, and their SVG; a long legend is wrapped."""
    least = max(
        text_width(title or "", _TITLE) + 2 * _EDGE,
        max((e.width for e in lines), default=0.0) + 2 * _EDGE,
    )
    wide = max(0.0, least - page.width) / 2
    page = Rect(page.x0 - wide, page.y0, page.x1 + wide, page.y1)
    out = []
    if title:
        page = Rect(page.x0, page.y0 - 28.0, page.x1, page.y1)
        at = ((page.x0 + page.x1) / 2, page.y0 + 28.0)
        out.append(paint.text(at, title, _TITLE, paint.INK, bold=True))
    x, y = page.x0 + _EDGE, page.y1 + 6.0
    for e in lines:
        if x > page.x0 + _EDGE and x + e.width > page.x1 - _EDGE + 20.0:
            x, y = page.x0 + _EDGE, y + _LINE
        out.append(e.sample((x, y)))
        at = (x + _SAMPLE + text_width(e.text, SMALL) / 2, y)
        out.append(paint.text(at, e.text, SMALL, e.colour))
        x += e.width
    bottom = y + 16.0 if lines else page.y1
    group = ['<g class="legend">', *out, "</g>"] if out else []
    return Rect(page.x0, page.y0, page.x1, bottom), group


def _patch(p: Point, fill: str, ink: str) -> str:
    return paint.box(Rect(p[0], p[1] - 9.0, p[0] + 14.0, p[1] + 1.0), fill, ink, 0.8, 3.0)


def _end(p: Point, colour: str) -> str:
    y = p[1] - 4.0
    bond = paint.line(((p[0], y), (p[0] + 12.0, y)), paint.INK, 1.7)
    stroke = paint.line(((p[0] + 12.0, y - 6.0), (p[0] + 12.0, y + 6.0)), colour, 3.0)
    return bond + stroke


def _dashes(p: Point) -> str:
    y = p[1] - 4.0
    return paint.line(((p[0], y), (p[0] + 15.0, y)), paint.FAINT, 1.0, "3 3")
