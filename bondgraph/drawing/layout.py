"""Where everything goes: a main path from left to right, the rest above and below it.

Boxes are composed bottom up (a one-port, a node with its one-ports and branches, a lane of nodes,
the page), each part moved just far enough to clear the others, so labels cannot overlap.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil

import networkx as nx

from bondgraph.drawing.geometry import Point, Rect, cut, hull
from bondgraph.drawing.labels import Label, label
from bondgraph.drawing.routing import route
from bondgraph.drawing.skeleton import Component, components
from bondgraph.elements import Sensor, Source
from bondgraph.graph import Bond, BondGraph

BOND, ROW_GAP, ITEM_GAP, MARGIN, ROW_WIDTH = 58.0, 48.0, 20.0, 4.0, 1250.0
_Pair = tuple[str, str]


@dataclass(frozen=True)
class Layout:
    """A placed bond graph.

    Attributes
    ----------
    anchors : dict of str to (x, y)
        Point of each element its bonds aim at.
    labels : dict of str to Label
        Label of each element, relative to its anchor.
    wires : dict of Bond to points
        Each bond from tail to head, already cut at the labels.
    page : Rect
        Box around everything.
    """

    anchors: Mapping[str, Point]
    labels: Mapping[str, Label]
    wires: Mapping[Bond, tuple[Point, ...]]
    page: Rect

    @property
    def boxes(self) -> Mapping[str, tuple[Rect, ...]]:
        """Boxes of text on the page, by element."""
        return {
            n: tuple(r.shifted(*self.anchors[n]) for r in label.parts)
            for n, label in self.labels.items()
        }


def layout(
    graph: BondGraph, captions: Mapping[str, str] | None = None, ringed: Iterable[str] = ()
) -> Layout:
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
    placer = _Placer(graph, dict(captions or {}), frozenset(ringed))
    parts = [placer.component(c) for c in components(graph)]
    done = _stack(parts)
    return _finish(graph, placer, done)


@dataclass(frozen=True)
class _Part:
    """A piece under composition: anchors, inner points of wires, the boxes that must stay clear."""

    anchors: dict[str, Point]
    vias: dict[_Pair, tuple[Point, ...]]
    box: Rect
    upper: Rect | None = None
    middle: Rect | None = None
    lower: Rect | None = None

    def shifted(self, dx: float, dy: float) -> _Part:
        def move(r: Rect | None) -> Rect | None:
            return None if r is None else r.shifted(dx, dy)

        return _Part(
            {n: (x + dx, y + dy) for n, (x, y) in self.anchors.items()},
            {k: tuple((x + dx, y + dy) for x, y in v) for k, v in self.vias.items()},
            self.box.shifted(dx, dy),
            move(self.upper),
            move(self.middle),
            move(self.lower),
        )


def _merged(parts: Sequence[_Part], **bands: Rect | None) -> _Part:
    anchors: dict[str, Point] = {}
    vias: dict[_Pair, tuple[Point, ...]] = {}
    for p in parts:
        anchors |= p.anchors
        vias |= p.vias
    return _Part(anchors, vias, hull(p.box for p in parts), **bands)


def _stack(parts: Sequence[_Part]) -> _Part:
    """Parts beneath each other, left edges aligned."""
    y, placed = 0.0, []
    for p in parts:
        placed.append(p.shifted(-p.box.x0, y - p.box.y0))
        y += p.box.height + ROW_GAP
    return _merged(placed)


class _Placer:
    """Composes parts for one graph."""

    def __init__(self, graph: BondGraph, captions: dict[str, str], ringed: frozenset[str]) -> None:
        self.graph = graph
        self.captions = captions
        self.ringed = ringed
        self.labels: dict[str, Label] = {n: self._label(n) for n in graph.elements}

    def _label(self, name: str, *, above: bool = False) -> Label:
        caption = self.captions.get(name, "")
        return label(self.graph[name], caption, ringed=name in self.ringed, above=above)

    def component(self, c: Component) -> _Part:
        """Rows of the main path, the second one from right to left and so on."""
        first, last = c.spine[0], c.spine[-1]
        ends: dict[str, str] = {}
        sources = [n for n in c.leaves[first] if isinstance(self.graph[n], Source)]
        if sources:
            ends[first] = sources[0]
        spare = [n for n in c.leaves[last] if n not in ends.values()]
        if first != last and spare:
            ends[last] = spare[0]
        blocks = [self._block(c, n, set(c.spine), ends.get(n), (-1, 1)) for n in c.spine]
        rows = _rows([b.box.width + BOND for b in blocks])
        placed: list[_Part] = []
        y = 0.0
        for i, (a, b) in enumerate(rows):
            row = blocks[a:b] if i % 2 == 0 else blocks[a:b][::-1]
            names = c.spine[a:b] if i % 2 == 0 else c.spine[a:b][::-1]
            part = self._row(row, names, ends, first, backwards=i % 2 == 1)
            dx = 0.0 if not placed else _align(placed[-1].box, part.box, right=i % 2 == 1)
            part = part.shifted(dx, y - part.box.y0)
            placed.append(part)
            y += part.box.height + ROW_GAP
        whole = _merged(placed)
        for i, (_, b) in enumerate(rows[:-1]):
            p, q = c.spine[b - 1], c.spine[b]
            pair = hull((placed[i].box, placed[i + 1].box))
            x = pair.x1 + 24.0 if i % 2 == 0 else pair.x0 - 24.0
            whole.vias[p, q] = ((x, whole.anchors[p][1]), (x, whole.anchors[q][1]))
        return whole

    def _row(
        self,
        blocks: Sequence[_Part],
        names: Sequence[str],
        ends: Mapping[str, str],
        first: str,
        *,
        backwards: bool,
    ) -> _Part:
        parts: list[_Part] = []
        for block, n in zip(blocks, names, strict=True):
            if n in ends:
                outward = -1.0 if (n == first) != backwards else 1.0
                block = self._with_end(block, n, ends[n], outward)
            parts.append(block)
        return _lane(parts)

    def _with_end(self, block: _Part, node: str, leaf: str, side: float) -> _Part:
        body, own = self.labels[leaf], self.labels[node]
        reach = own.parts[0].x1 + BOND + body.box.width / 2
        at = (block.anchors[node][0] + side * reach, block.anchors[node][1])
        box = body.box.shifted(*at)
        middle = hull([r for r in (block.middle, box) if r is not None])
        return _Part(
            block.anchors | {leaf: at},
            block.vias,
            hull((block.box, box)),
            block.upper,
            middle,
            block.lower,
        )

    def _block(
        self, c: Component, node: str, lane: set[str], skip: str | None, sides: tuple[int, ...]
    ) -> _Part:
        """Put a node at the origin with its one-ports and branches above (-1) and below (1)."""
        own = self.labels[node]
        branches = [m for m in c.tree[node] if m not in lane] if node in c.tree else []
        leaves = [n for n in c.leaves[node] if n != skip]
        rows: dict[int, list[tuple[_Part, str]]] = {s: [] for s in sides}
        for m in branches:
            s = sides[-1] if len(sides) == 1 else min(sides, key=lambda s: (len(rows[s]), -s))
            rows[s].append((self._branch(c, m, node, s), m))
        for n in sorted(leaves, key=lambda n: isinstance(self.graph[n], Sensor)):
            s = min(sides, key=lambda s: (len(rows[s]), s))
            if s < 0:
                self.labels[n] = self._label(n, above=True)
            rows[s].insert(0, (_Part({n: (0.0, 0.0)}, {}, self.labels[n].box), n))
        parts = [_Part({node: (0.0, 0.0)}, {}, own.box)]
        bands: dict[int, Rect | None] = {-1: None, 1: None}
        for s, items in rows.items():
            if items:
                placed = _items(node, items, s, own.box)
                parts.append(placed)
                edge = own.box.y0 if s < 0 else own.box.y1
                bands[s] = hull((placed.box, Rect(0.0, edge, 0.0, edge)))
        return _merged(parts, upper=bands[-1], middle=own.box, lower=bands[1])

    def _branch(self, c: Component, root: str, parent: str, side: int) -> _Part:
        """Compose a lane that starts at `root`, kept free on the side of its parent."""
        tree = nx.Graph(c.tree)
        tree.remove_edge(root, parent)
        depth = nx.single_source_shortest_path(tree, root)
        path = max(depth.values(), key=len)
        cut_off = Component(tree, c.leaves, path)
        last = path[-1]
        end = c.leaves[last][0] if len(path) > 1 and c.leaves[last] else None
        blocks = []
        for n in path:
            sides = (side,) if n == root else (-1, 1)
            block = self._block(cut_off, n, set(path), end if n == last else None, sides)
            if n == last and end:
                block = self._with_end(block, n, end, 1.0)
            blocks.append(block)
        return _lane(blocks, shaft=-side)


def _items(node: str, items: Sequence[tuple[_Part, str]], side: int, own: Rect) -> _Part:
    """One-ports and branches in a row, near edges aligned, centred on the node."""
    x, row = 0.0, []
    for part, _ in items:
        row.append(part.shifted(x - part.box.x0, 0.0))
        x += part.box.width + ITEM_GAP
    heads = [p.anchors[n][0] for p, (_, n) in zip(row, items, strict=True)]
    centre = (min(heads) + max(heads)) / 2
    gap = max(ROW_GAP, 0.4 * (max(heads) - centre))
    edge = own.y0 - gap if side < 0 else own.y1 + gap
    placed = []
    for part, (_, n) in zip(row, items, strict=True):
        near = part.box.y1 if side < 0 else part.box.y0
        moved = part.shifted(-centre, edge - near)
        moved.vias[node, n] = ((moved.anchors[n][0], edge),)
        placed.append(moved)
    return _merged(placed)


def _lane(blocks: Sequence[_Part], shaft: int = 0) -> _Part:
    """Blocks from left to right, each as far left as its neighbours allow.

    `shaft` (-1 above, 1 below) keeps the column over the first block free for its bond.
    """
    placed: list[_Part] = []
    for b in blocks:
        dx = 0.0
        for p in placed:
            dx = max(dx, _clear(p.upper, b.upper, ITEM_GAP), _clear(p.lower, b.lower, ITEM_GAP))
            dx = max(dx, _clear(p.middle, b.middle, BOND))
        if placed and shaft:
            band = b.upper if shaft < 0 else b.lower
            dx = max(dx, _clear(Rect(-8.0, 0.0, 8.0, 0.0), band, ITEM_GAP))
        placed.append(b.shifted(dx, 0.0))
    return _merged(placed)


def _clear(a: Rect | None, b: Rect | None, gap: float) -> float:
    return 0.0 if a is None or b is None else a.x1 + gap - b.x0


def _rows(widths: Sequence[float]) -> list[tuple[int, int]]:
    """Index ranges of rows of about equal width."""
    count = max(1, ceil(sum(widths) / ROW_WIDTH - 0.3))
    target = sum(widths) / count
    rows: list[tuple[int, int]] = []
    start, used = 0, 0.0
    for i, w in enumerate(widths):
        if used and used + w / 2 > target and len(rows) < count - 1:
            rows.append((start, i))
            start, used = i, 0.0
        used += w
    return [*rows, (start, len(widths))]


def _align(above: Rect, part: Rect, *, right: bool) -> float:
    return above.x1 - part.x1 if right else above.x0 - part.x0


def _finish(graph: BondGraph, placer: _Placer, part: _Part) -> Layout:
    labels, anchors = placer.labels, part.anchors
    boxes = {n: [r.shifted(*anchors[n]) for r in labels[n].parts] for n in graph.elements}
    tree = {b: via for b in graph.bonds if (via := _via(part, b)) is not None}
    straight = _straight(graph, part)
    wires: dict[Bond, tuple[Point, ...]] = {}
    for b in graph.bonds:
        if b in tree or b in straight:
            path = (anchors[b.tail], *tree.get(b, ()), anchors[b.head])
            wires[b] = _cut(path, boxes, b)
    for b in graph.bonds:
        if b not in wires:
            path = route(anchors[b.tail], anchors[b.head], boxes, (b.tail, b.head), wires.values())
            wires[b] = _cut(path, boxes, b)
    points = [Rect(x, y, x, y) for w in wires.values() for x, y in w]
    page = hull([*points, *(r for rs in boxes.values() for r in rs)])
    return Layout(anchors, labels, {b: wires[b] for b in graph.bonds}, page.grown(24.0))


def _cut(path: Sequence[Point], boxes: Mapping[str, list[Rect]], b: Bond) -> tuple[Point, ...]:
    tail, head = _grown(boxes[b.tail], path), _grown(boxes[b.head], path[::-1])
    return cut(path, tail, head)


def _grown(shape: Sequence[Rect], path: Sequence[Point]) -> list[Rect]:
    """Shape at the start of a path with a margin: more room for the stroke of a slanting bond."""
    tight = [r.grown(MARGIN) for r in shape]
    k = next((k for k in range(1, len(path)) if not any(r.contains(path[k]) for r in tight)), 1)
    dx, dy = abs(path[k][0] - path[k - 1][0]), abs(path[k][1] - path[k - 1][1])
    return [r.grown(MARGIN + 7.0 * min(dx, dy) / max(dx, dy, 1.0)) for r in shape]


def _via(part: _Part, b: Bond) -> tuple[Point, ...] | None:
    if (b.tail, b.head) in part.vias:
        return part.vias[b.tail, b.head]
    back = part.vias.get((b.head, b.tail))
    return None if back is None else back[::-1]


def _straight(graph: BondGraph, part: _Part) -> set[Bond]:
    """Bonds on one level with no anchor between their ends."""
    levels: dict[float, list[tuple[float, str]]] = {}
    for n, (x, y) in part.anchors.items():
        levels.setdefault(round(y, 3), []).append((x, n))
    next_to: set[_Pair] = set()
    for level in levels.values():
        names = [n for _, n in sorted(level)]
        next_to |= set(pairwise(names))
    return {b for b in graph.bonds if {(b.tail, b.head), (b.head, b.tail)} & next_to}
