"""Drawing of a bond graph as SVG: half arrows, causal strokes, taps, marked elements."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

from bondgraph.causality import Causality, assign_causality
from bondgraph.drawing import paint
from bondgraph.drawing.geometry import Rect
from bondgraph.drawing.labels import SMALL, element_domains, text_width
from bondgraph.drawing.layout import Layout, layout
from bondgraph.elements import Element, Sensor
from bondgraph.errors import GraphError, unknown_name
from bondgraph.graph import Bond, BondGraph

__all__ = ["Layout", "layout", "svg"]


def svg(
    graph: BondGraph,
    *,
    causality: Causality | None = None,
    marked: Mapping[str, str] | None = None,
    also: Iterable[str] = (),
    title: str | None = None,
) -> str:
    """Draw `graph` as a self-contained SVG.

    Parameters
    ----------
    graph : BondGraph
        Any graph; one whose causality fails is drawn without strokes.
    causality : Causality, optional
        Strokes; assigned here when not given.
    marked : mapping of str to str, optional
        Short captions by element name, drawn with a solid ring.
    also : iterable of str
        Elements that cannot be told apart from the marked ones, drawn with a dashed ring.
    title : str, optional
        Heading.

    Returns
    -------
    str
        SVG text.

    Examples
    --------
    >>> from bondgraph import BondGraph, One, R, Se
    >>> with BondGraph("lamp") as g:
    ...     _ = Se("V", unit="V") >> One("loop") >> R("R_1", 5.0, unit="ohm")
    >>> "R : R_1" in svg(g)
    True
    """
    captions, dashed = dict(marked or {}), frozenset(also)
    for n in (*captions, *sorted(dashed)):
        if n not in graph.elements:
            raise unknown_name("element", n, graph.name, graph.elements)
    plan = layout(graph, captions, {*captions, *dashed})
    strokes = _strokes(graph, causality)
    domains = element_domains(graph)
    parts = [_bond(graph, plan, strokes, b) for b in graph.bonds]
    for n, e in graph.elements.items():
        ring = "marked" if n in captions else "also" if n in dashed else ""
        parts.append(paint.element(plan.labels[n], plan.anchors[n], domains[n], _tip(e), ring))
    page, extra = _frame(plan.page, title, domains)
    return _document(page, [*parts, *extra], title or f"bond graph {graph.name}")


def _strokes(graph: BondGraph, causality: Causality | None) -> dict[Bond, str]:
    """End that receives the effort, by bond; empty if causality cannot be assigned."""
    if causality is None:
        try:
            causality = assign_causality(graph)
        except GraphError:
            return {}
    return {b: s.effort_to for b, s in causality.strokes.items()}


def _bond(graph: BondGraph, plan: Layout, strokes: Mapping[Bond, str], b: Bond) -> str:
    points = plan.wires[b]
    if isinstance(graph[b.head], Sensor):
        return paint.tap(points)
    if isinstance(graph[b.tail], Sensor):
        return paint.tap(points[::-1])
    to = strokes.get(b)
    tip = b.name if to is None else f"{b.name}: effort to {to}"
    return paint.power_bond(points, None if to is None else to == b.head, tip)


def _tip(e: Element) -> str:
    """Text shown when the pointer rests on an element."""
    unit = getattr(e, "unit", "")
    value = getattr(e, "stiffness", None)
    for field in ("value", "ratio"):
        value = getattr(e, field, None) if value is None else value
    shown = "" if value is None else f" = {value}"
    return f"{e.kind} {e.name}{shown}{f' {unit}' if unit else ''}"


def _frame(page: Rect, title: str | None, domains: Mapping[str, str]) -> tuple[Rect, list[str]]:
    """Page grown by heading and legend, and their SVG."""
    extra = []
    present = [d for d in paint.FILL if d and d in domains.values()]
    widths = [text_width(d, SMALL) + 40.0 for d in present]
    least = max(text_width(title or "", 16.0) + 48.0, sum(widths) + 24.0 if len(present) > 1 else 0)
    wide = max(0.0, least - page.width) / 2
    page = Rect(page.x0 - wide, page.y0, page.x1 + wide, page.y1)
    if title:
        page = Rect(page.x0, page.y0 - 28.0, page.x1, page.y1)
        at = ((page.x0 + page.x1) / 2, page.y0 + 28.0)
        extra.append(paint.text(at, title, 16.0, paint.INK, bold=True))
    if len(present) > 1:
        page = Rect(page.x0, page.y0, page.x1, page.y1 + 22.0)
        x, y = page.x0 + 24.0, page.y1 - 16.0
        for d, w in zip(present, widths, strict=True):
            fill, ink = paint.FILL[d]
            extra.append(paint.box(Rect(x, y - 9.0, x + 14.0, y + 1.0), fill, ink, 0.8, 3.0))
            extra.append(paint.text((x + 20.0 + (w - 40.0) / 2, y), d, SMALL, ink))
            x += w
    return page, extra


def _document(page: Rect, parts: Iterable[str], name: str) -> str:
    x, y, w, h = (paint.number(v) for v in (page.x0, page.y0, page.width, page.height))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{x} {y} {w} {h}" width="{w}"'
        f' height="{h}" style="max-width:100%;height:auto" role="img"'
        f' font-family="{paint.FONT}">'
        f"<title>{escape(name)}</title>"
        f'<rect x="{x}" y="{y}" width="{w}" height="{h}" fill="#ffffff"/>'
        + "".join(parts)
        + "</svg>"
    )
