"""Composition of a piece of a graph: a main path in rows, the rest above and below it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise

from bondgraph.drawing.geometry import Rect, hull
from bondgraph.drawing.labels import Label, label
from bondgraph.drawing.parts import Part, Spacing, fanned, lane, merged, snake, wrap
from bondgraph.drawing.readings import DrawnReading
from bondgraph.drawing.skeleton import Component
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor


class Placer:
    """Composes the parts of one graph; `labels` are those of the elements placed so far."""

    def __init__(
        self,
        graph: BondGraph,
        captions: Mapping[str, str],
        ringed: frozenset[str],
        spacing: Spacing,
        signals: Sequence[DrawnReading],
    ) -> None:
        self.graph = graph
        self.captions = captions
        self.ringed = ringed
        self.spacing = spacing
        self.busy = Counter(n for r in signals for n in (r.source, r.target))
        self.labels: dict[str, Label] = {n: self._label(n) for n in graph.elements}

    def component(self, c: Component) -> Part:
        """Place one piece; the main path begins at a source and ends at a one-port."""
        path = c.path(c.root)
        first, last = path[0], path[-1]
        ends: dict[str, str] = {}
        sources = [n for n in c.leaves[first] if isinstance(self.graph[n], Source)]
        if sources:
            ends[first] = sources[0]
        spare = [n for n in c.leaves[last] if n not in ends.values()]
        if first != last and spare:
            ends[last] = spare[0]
        return self._path(c, path, ends, None)

    def _path(
        self, c: Component, path: Sequence[str], ends: Mapping[str, str], side: int | None
    ) -> Part:
        """Nodes of a path in wrapped rows; `side` is where a branch lies, None for a main path."""
        blocks = [
            self._block(c, n, path[i + 1 : i + 2], ends.get(n), (side,) if side and not i else None)
            for i, n in enumerate(path)
        ]
        at = [p[0] for n, p in lane(blocks, self.spacing).anchors.items() if n in set(path)]
        extents = [b - a for a, b in pairwise([*at, at[-1] + self.spacing.bond])]
        rows: list[Part] = []
        names: list[Sequence[str]] = []
        for i, (a, b) in enumerate(wrap(extents, self.spacing.width)):
            row = [
                self._with_end(blocks[k], n, ends[n], -1.0 if (n == path[0]) != (i % 2 == 1) else 1)
                if (n := path[k]) in ends
                else blocks[k]
                for k in range(a, b)
            ]
            names.append(path[a:b])
            shaft = -side if side and not i else 0
            rows.append(lane(row[::-1] if i % 2 else row, self.spacing, shaft))
        return snake(rows, names, side != -1, self.spacing)

    def _block(
        self,
        c: Component,
        node: str,
        lane_next: Sequence[str],
        skip: str | None,
        sides: tuple[int, ...] | None,
    ) -> Part:
        """Put a node at the origin with its one-ports and branches above (-1) and below (1)."""
        own = self.labels[node]
        sides = sides or (-1, 1)
        rows: dict[int, list[tuple[Part, str]]] = {s: [] for s in sides}
        arms: dict[int, list[tuple[Part, str]]] = {s: [] for s in sides}
        for m in (m for m in c.children[node] if m not in lane_next):
            s = min(sides, key=lambda s: (len(arms[s]), -s))
            arms[s].append((self._branch(c, m, s), m))
        leaves = [n for n in c.leaves[node] if n != skip]
        for n in sorted(leaves, key=lambda n: isinstance(self.graph[n], Sensor)):
            s = min(sides, key=lambda s: (len(rows[s]) + len(arms[s]), s))
            self.labels[n] = self._label(n, above=s < 0)
            rows[s].insert(0, (Part({n: (0.0, 0.0)}, {}, self.labels[n].box), n))
        parts = [Part({node: (0.0, 0.0)}, {}, own.box)]
        bands: dict[int, Rect | None] = {-1: None, 1: None}
        for s in sides:  # branches outside, growing away from the node
            left = [(part.mirrored(), m) for part, m in arms[s][1::2]]
            rows[s] = [*left[::-1], *rows[s], *arms[s][::2]]
        free = self._routed(c, node) - sum(not items for items in rows.values())
        for s, items in sorted(rows.items(), key=lambda row: len(row[1]) % 2):
            if items:
                middle, free = free > 0, free - 1
                placed = fanned(node, items, s, own.box, self.spacing, open_middle=middle)
                parts.append(placed)
                edge = own.box.y0 if s < 0 else own.box.y1
                bands[s] = hull((placed.box, Rect(0.0, edge, 0.0, edge)))
        return merged(parts, upper=bands[-1], middle=own.box, lower=bands[1])

    def _routed(self, c: Component, node: str) -> int:
        """Count the wires at a node that are not part of the tree."""
        root = int(node != c.root)
        tree = len(c.children[node]) + len(c.leaves[node]) + root
        return len(self.graph.bonds_of(node)) - tree + self.busy[node]

    def _branch(self, c: Component, root: str, side: int) -> Part:
        """Compose a path that starts at `root`, kept free on the side of its parent."""
        path = c.path(root)
        last = path[-1]
        ends = {last: c.leaves[last][0]} if len(path) > 1 and c.leaves[last] else {}
        return self._path(c, path, ends, side)

    def _with_end(self, block: Part, node: str, leaf: str, side: float) -> Part:
        """Add a one-port in the lane, to the left (-1) or right (1) of its node."""
        body, own = self.labels[leaf], self.labels[node]
        reach = own.parts[0].x1 + self.spacing.bond + body.box.width / 2
        at = (block.anchors[node][0] + side * reach, block.anchors[node][1])
        box = body.box.shifted(*at)
        middle = hull([r for r in (block.middle, box) if r is not None])
        return Part(
            block.anchors | {leaf: at},
            block.vias,
            hull((block.box, box)),
            block.upper,
            middle,
            block.lower,
        )

    def _label(self, name: str, *, above: bool = False) -> Label:
        caption = self.captions.get(name, "")
        return label(self.graph[name], caption, ringed=name in self.ringed, above=above)
