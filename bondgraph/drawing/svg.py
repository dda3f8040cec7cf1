"""Drawing of a bond graph as SVG: half arrows, causal strokes, taps, marked elements."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

from bondgraph.causality.assignment import Causality, assign_causality
from bondgraph.drawing import paint, shading
from bondgraph.drawing.geometry import Rect
from bondgraph.drawing.labels import describe, element_domains
from bondgraph.drawing.layout import GraphLayout, layout
from bondgraph.drawing.legend import entries, framed
from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.elements import RS, Multiport, Switched
from bondgraph.graph.sensors import Sensor
from bondgraph.support.errors import GraphError, require_known
from bondgraph.support.spelled import spelled


@spelled
def svg(
    graph: BondGraph,
    *,
    causality: Causality | None = None,
    marked: Mapping[str, str] | None = None,
    also: Iterable[str] = (),
    shades: Mapping[str, float] | None = None,
    title: str | None = None,
    numbers: bool = True,
) -> str:
    """Draw `graph` as a self-contained SVG.

    Bonds carry half arrows, causal strokes (coloured where a storage has derivative causality or
    the causality was chosen freely) and, on pointing, the reason of the stroke. Dashed arrows lead
    to sensors and, thinner, from a signal to the element it modulates.

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
    shades : mapping of str to float, optional
        Confidence between 0 and 1 by element: the fill goes from white to orange with it, and
        from 1 % on it is written below.
    title : str, optional
        Heading.
    numbers : bool
        Whether it is written at all.

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
    fills = dict(shades or {})
    require_known("element", graph.name, graph.elements, *captions, *sorted(dashed), *fills)
    written = shading.captions(captions, fills if numbers else {})
    plan = layout(graph, written, {*captions, *dashed})
    causality = _causality(graph) if causality is None else causality
    kinds = _kinds(graph, causality)
    domains = element_domains(graph)
    parts = [_bond(graph, plan, causality, kinds, b) for b in graph.bonds]
    for reading, points in plan.signals.items():
        tip = f"{reading.target} reads {', '.join(reading.signals)}"
        parts.append(paint.signal(points, tip))
    for n, e in graph.elements.items():
        ring = "marked" if n in captions else "also" if n in dashed else ""
        off = isinstance(e, Switched) and not e.on
        tip = describe(e)
        fill = shading.fill(fills[n]) if n in fills else ""
        parts.append(
            paint.element(
                plan.labels[n], plan.anchors[n], domains[n], tip, ring, off=off, fill=fill, name=n
            )
        )
    legend = entries(() if fills else domains.values(), kinds.values(), signals=bool(plan.signals))
    legend += shading.legend(bool(fills), bool(captions), bool(dashed))
    page, extra = framed(plan.page, title, legend)
    return _document(page, [*parts, *extra], title or f"bond graph {graph.name}")


def _causality(graph: BondGraph) -> Causality | None:
    """Strokes; None if they cannot be assigned."""
    try:
        return assign_causality(graph)
    except GraphError:
        return None


def _kinds(graph: BondGraph, causality: Causality | None) -> dict[Bond, str]:
    """Bonds of storages in derivative causality and of free choices."""
    if causality is None:
        return {}
    places = {b.name: b for b in reversed(graph.bonds)}
    for e in graph.elements.values():
        for i, b in enumerate(graph.bonds_of(e.name), start=1):
            places[f"{e.name}{i}" if isinstance(e, Multiport) else e.name] = b
    for b in graph.bonds:
        if isinstance(graph[b.head], RS):  # chosen at its resistive port, where power enters
            places[b.head] = b
    free = {places[n]: "free" for n in causality.free_choices if n in places}
    return free | {places[n]: "derivative" for n in causality.derivative if n in places}


def _bond(
    graph: BondGraph,
    plan: GraphLayout,
    causality: Causality | None,
    kinds: Mapping[Bond, str],
    b: Bond,
) -> str:
    points = plan.wires[b]
    stroke = causality.strokes.get(b) if causality else None
    tip = b.name if stroke is None else str(stroke)
    if stroke is None and isinstance(graph[b.head], Sensor):
        return paint.tap(points, tip)
    if stroke is None and isinstance(graph[b.tail], Sensor):
        return paint.tap(points[::-1], tip)
    at_head = None if stroke is None else stroke.effort_to == b.head
    return paint.power_bond(points, at_head, tip, paint.STROKES[kinds.get(b, "")], (b.tail, b.head))


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
