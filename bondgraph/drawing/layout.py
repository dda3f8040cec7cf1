"""Where everything goes: a main path from left to right, the rest above and below it.

Boxes are composed bottom up (a one-port, a node with its one-ports and branches, a lane of nodes,
the page), so labels cannot overlap. Bonds that close rings and signals are routed around them. If
there is no free way, the same drawing is tried with wider gaps.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot

from bondgraph.drawing.crossings import Obstacles, count_crossings
from bondgraph.drawing.geometry import Point, Rect, cut, hull
from bondgraph.drawing.labels import Label
from bondgraph.drawing.parts import Part, Spacing, stacked
from bondgraph.drawing.placing import Placer
from bondgraph.drawing.readings import DrawnReading, readings
from bondgraph.drawing.routing import route
from bondgraph.drawing.skeleton import Component, components
from bondgraph.graph.bond_graph import Bond, BondGraph

MARGIN, _STROKE = 4.0, 8.0
_SEARCHED = 150  # larger graphs with rings are drawn from their first spanning tree
_WIRED = 120  # elements in all variants whose wires are routed for comparison
_REROUTED = 30  # up to so many wires a second round finds better ways
_WIDER = (1.0, 1.4, 2.0)
_Edge = Bond | DrawnReading


@dataclass(frozen=True)
class GraphLayout:
    """A placed bond graph.

    Attributes
    ----------
    anchors : dict of str to (x, y)
        Point of each element its bonds aim at.
    labels : dict of str to Label
        Label of each element, relative to its anchor.
    wires : dict of Bond to points
        Each bond from tail to head, already cut at the labels.
    signals : dict of DrawnReading to points
        Each modulating signal from where it is read to the element it modulates.
    page : Rect
        Box around everything.
    """

    anchors: Mapping[str, Point]
    labels: Mapping[str, Label]
    wires: Mapping[Bond, tuple[Point, ...]]
    signals: Mapping[DrawnReading, tuple[Point, ...]]
    page: Rect

    @property
    def boxes(self) -> Mapping[str, tuple[Rect, ...]]:
        """Boxes of text on the page, by element."""
        return {
            n: tuple(r.shifted(*self.anchors[n]) for r in label.parts)
            for n, label in self.labels.items()
        }

    @property
    def crossings(self) -> int:
        """Number of points where two wires cross."""
        return count_crossings([*self.wires.values(), *self.signals.values()])


def layout(
    graph: BondGraph, captions: Mapping[str, str] | None = None, ringed: Iterable[str] = ()
) -> GraphLayout:
    """Place `graph`.

    Parameters
    ----------
    graph : BondGraph
        Any graph, sound or not.
    captions : mapping of str to str, optional
        Captions of marked elements.
    ringed : iterable of str
        Elements with a ring and no caption.
    """
    marks = (dict(captions or {}), frozenset(ringed))
    pieces = components(graph)
    signals = readings(graph)
    closing = len(graph.bonds) - len(graph.elements) + len(pieces) + len(signals)
    first = Spacing().scaled(1.0 + min(0.04 * closing, 0.4))
    plans: list[tuple[int, int, float, GraphLayout]] = []
    for by in _WIDER:
        spacing = first.scaled(by)
        ranked = [_ranked(graph, Placer(graph, *marks, spacing, signals), v) for v in pieces]
        for k in range(max((len(r) for r in ranked), default=1)):
            placer = Placer(graph, *marks, spacing, signals)
            parts = [placer.component(r[min(k, len(r) - 1)]) for r in ranked]
            plan = _wired(graph, placer, stacked(parts, spacing.row), signals)
            size = plan.page.width + plan.page.height
            plans.append((_hidden(plan), plan.crossings, size, plan))
        best = min(plans, key=lambda p: p[:3])
        if not best[0]:
            break
    return best[3]


def _ranked(graph: BondGraph, placer: Placer, variants: Sequence[Component]) -> list[Component]:
    """Return the variants whose remaining bonds would be short and cross little if straight."""
    if len(variants) == 1 or len(graph.elements) > _SEARCHED:
        return [variants[0]]
    badness = [_badness(graph, placer.component(c)) for c in variants]
    order = sorted(range(len(variants)), key=badness.__getitem__)
    most = max(1, min(3, _WIRED // len(graph.elements)))
    return [variants[k] for k in order[:most]]


def _badness(graph: BondGraph, part: Part) -> float:
    joined, open_ends = [], []
    for b in graph.bonds:
        if b.tail in part.anchors:
            via = _via(part, b)
            a, c = part.anchors[b.tail], part.anchors[b.head]
            if via is None and a[1] != c[1]:
                open_ends.append((a, c))
            else:
                joined.append((a, *(via or ()), c))
    length = sum(abs(a[0] - c[0]) + abs(a[1] - c[1]) for a, c in open_ends)
    shape = max(part.box.width, 1.4 * part.box.height)
    return 120.0 * count_crossings([*joined, *open_ends]) + length + shape


def _wired(
    graph: BondGraph, placer: Placer, part: Part, signals: Sequence[DrawnReading]
) -> GraphLayout:
    labels, anchors = placer.labels, part.anchors
    boxes = {n: [r.shifted(*anchors[n]) for r in labels[n].parts] for n in graph.elements}
    page = hull([part.box, *(r for rs in boxes.values() for r in rs)])
    obstacles = Obstacles(boxes)
    done: dict[_Edge, tuple[Point, ...]] = {}
    for b in graph.bonds:
        via = _via(part, b)
        if via is not None or _in_line(b, anchors, obstacles):
            done[b] = _cut((anchors[b.tail], *(via or ()), anchors[b.head]), boxes, _ends(b))
    rest: list[_Edge] = [*(b for b in graph.bonds if b not in done), *signals]
    rest.sort(key=lambda e: (isinstance(e, DrawnReading), _distance(anchors, _ends(e))))
    for _ in range(2 if 1 < len(rest) <= _REROUTED else 1):
        for e in rest:
            done.pop(e, None)
            path = route(_ends(e), anchors, boxes, list(done.values()), page)
            done[e] = _cut(path, boxes, _ends(e))
    points = [Rect(x, y, x, y) for w in done.values() for x, y in w]
    page = hull([*points, *(r for rs in boxes.values() for r in rs)]).grown(24.0)
    return GraphLayout(
        anchors, labels, {b: done[b] for b in graph.bonds}, {s: done[s] for s in signals}, page
    )


def _ends(e: _Edge) -> tuple[str, str]:
    return (e.source, e.target) if isinstance(e, DrawnReading) else (e.tail, e.head)


def _distance(anchors: Mapping[str, Point], ends: tuple[str, str]) -> float:
    (x0, y0), (x1, y1) = anchors[ends[0]], anchors[ends[1]]
    return abs(x1 - x0) + abs(y1 - y0)


def _cut(
    path: Sequence[Point], boxes: Mapping[str, list[Rect]], ends: tuple[str, str]
) -> tuple[Point, ...]:
    tail, head = _grown(boxes[ends[0]], path), _grown(boxes[ends[1]], path[::-1])
    return cut(path, tail, head)


def _grown(shape: Sequence[Rect], path: Sequence[Point]) -> list[Rect]:
    """Shape at the start of a path with a margin that clears the stroke, however it slants."""
    tight = [r.grown(MARGIN) for r in shape]
    k = next((k for k in range(1, len(path)) if not any(r.contains(path[k]) for r in tight)), 1)
    dx, dy = abs(path[k][0] - path[k - 1][0]), abs(path[k][1] - path[k - 1][1])
    length = hypot(dx, dy) or 1.0
    gx, gy = MARGIN + _STROKE * dy / length, MARGIN + _STROKE * dx / length
    return [Rect(r.x0 - gx, r.y0 - gy, r.x1 + gx, r.y1 + gy) for r in shape]


def _via(part: Part, b: Bond) -> tuple[Point, ...] | None:
    if (b.tail, b.head) in part.vias:
        return part.vias[b.tail, b.head]
    back = part.vias.get((b.head, b.tail))
    return None if back is None else back[::-1]


def _in_line(b: Bond, anchors: Mapping[str, Point], obstacles: Obstacles) -> bool:
    """Whether the ends are on one level with no label between them."""
    a, c = anchors[b.tail], anchors[b.head]
    return abs(a[1] - c[1]) < 1e-6 and not obstacles.hit((a, c), (b.tail, b.head))


def _hidden(plan: GraphLayout) -> int:
    """Count the wires that pass through a label of another element."""
    obstacles = Obstacles(plan.boxes)
    edges: list[tuple[_Edge, tuple[Point, ...]]] = [*plan.wires.items(), *plan.signals.items()]
    return sum(obstacles.hit(points, _ends(e)) for e, points in edges)
