"""Pieces of a drawing under composition, each moved just far enough to clear the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil

from bondgraph.drawing.geometry import Point, Rect, hull

Pair = tuple[str, str]
SIDE = 24.0  # room for the wire at the side of wrapped rows
MIDDLE = 24.0  # room for a wire between the items of a fan


@dataclass(frozen=True, slots=True)
class Spacing:
    """Gaps of a drawing: length of bonds in a lane, between rows, between neighbours in a row."""

    bond: float = 58.0
    row: float = 48.0
    item: float = 20.0
    width: float = 1250.0

    def scaled(self, by: float) -> Spacing:
        """Return wider gaps."""
        return Spacing(self.bond * by, self.row * by, self.item * by, self.width * by)


@dataclass(frozen=True, slots=True)
class Part:
    """Anchors, inner points of wires, and the boxes that must stay clear.

    `upper`, `middle` and `lower` are the parts of the box above, on and below the lane.
    """

    anchors: dict[str, Point]
    vias: dict[Pair, tuple[Point, ...]]
    box: Rect
    upper: Rect | None = None
    middle: Rect | None = None
    lower: Rect | None = None

    def shifted(self, dx: float, dy: float) -> Part:
        """Move everything."""
        return self._placed(lambda x, y: (x + dx, y + dy), lambda r: r.shifted(dx, dy))

    def mirrored(self) -> Part:
        """Exchange left and right; labels are symmetric about their anchors."""
        return self._placed(lambda x, y: (-x, y), lambda r: Rect(-r.x1, r.y0, -r.x0, r.y1))

    def _placed(self, point: Callable[[float, float], Point], rect: Callable[[Rect], Rect]) -> Part:
        bands = (self.upper, self.middle, self.lower)
        return Part(
            {n: point(x, y) for n, (x, y) in self.anchors.items()},
            {k: tuple(point(x, y) for x, y in v) for k, v in self.vias.items()},
            rect(self.box),
            *(None if r is None else rect(r) for r in bands),
        )


def merged(parts: Sequence[Part], **bands: Rect | None) -> Part:
    """Put parts that are in place into one."""
    anchors: dict[str, Point] = {}
    vias: dict[Pair, tuple[Point, ...]] = {}
    for p in parts:
        anchors |= p.anchors
        vias |= p.vias
    return Part(anchors, vias, hull(p.box for p in parts), **bands)


def stacked(parts: Sequence[Part], gap: float) -> Part:
    """Put parts beneath each other, left edges aligned."""
    y, placed = 0.0, []
    for p in parts:
        placed.append(p.shifted(-p.box.x0, y - p.box.y0))
        y += p.box.height + gap
    return merged(placed)


def fanned(
    node: str,
    items: Sequence[tuple[Part, str]],
    side: int,
    own: Rect,
    spacing: Spacing,
    *,
    open_middle: bool = False,
) -> Part:
    """One-ports and branches in a row, near edges aligned, centred on the node.

    `open_middle` keeps the column over the node free for a wire that is routed later.
    """
    gap_at = (len(items) + 1) // 2 if open_middle else -1
    x, row, centre = 0.0, [], 0.0
    for i, (part, _) in enumerate(items):
        if i == gap_at:
            centre = x - spacing.item / 2 + MIDDLE / 2
            x += MIDDLE
        row.append(part.shifted(x - part.box.x0, 0.0))
        x += part.box.width + spacing.item
    heads = [p.anchors[n][0] for p, (_, n) in zip(row, items, strict=True)]
    if not open_middle:
        centre = (min(heads) + max(heads)) / 2
        middle = heads[len(heads) // 2]
        if len(heads) % 2 and abs(middle - centre) < 40.0:
            centre = middle  # straight above or below the node
    elif gap_at == len(items):
        centre = x - spacing.item / 2 + MIDDLE / 2
    gap = max(spacing.row, 0.4 * max(max(heads) - centre, centre - min(heads)))
    edge = own.y0 - gap if side < 0 else own.y1 + gap
    placed = []
    for part, (_, n) in zip(row, items, strict=True):
        near = part.box.y1 if side < 0 else part.box.y0
        moved = part.shifted(-centre, edge - near)
        moved.vias[node, n] = ((moved.anchors[n][0], edge),)
        placed.append(moved)
    return merged(placed)


def lane(blocks: Sequence[Part], spacing: Spacing, shaft: int = 0) -> Part:
    """Blocks from left to right, each as far left as its neighbours allow.

    `shaft` (-1 above, 1 below) keeps the column over the first block free for its bond.
    """
    placed: list[Part] = []
    for b in blocks:
        dx = 0.0
        for p in placed:
            dx = max(
                dx,
                _clear(p.upper, b.upper, spacing.item),
                _clear(p.lower, b.lower, spacing.item),
                _clear(p.middle, b.middle, spacing.bond),
            )
        if placed and shaft:
            band = b.upper if shaft < 0 else b.lower
            dx = max(dx, _clear(Rect(-8.0, 0.0, 8.0, 0.0), band, spacing.item))
        placed.append(b.shifted(dx, 0.0))
    return merged(placed)


def snake(
    rows: Sequence[Part], names: Sequence[Sequence[str]], down: bool, spacing: Spacing
) -> Part:
    """Rows of one path, every second one from right to left, joined at the sides.

    `names` are the nodes of each row in the order of the path.
    """
    placed: list[Part] = []
    for i, row in enumerate(rows):
        dx = dy = 0.0
        if placed:
            last = placed[-1].box
            dx = last.x1 - row.box.x1 if i % 2 else last.x0 - row.box.x0
            dy = last.y1 + spacing.row - row.box.y0 if down else last.y0 - spacing.row - row.box.y1
        placed.append(row.shifted(dx, dy))
    whole = merged(placed)
    if len(rows) == 1:
        return whole
    for i, (upper, lower) in enumerate(pairwise(names)):
        p, q = upper[-1], lower[0]
        pair = hull((placed[i].box, placed[i + 1].box))
        x = pair.x1 + SIDE if i % 2 == 0 else pair.x0 - SIDE
        whole.vias[p, q] = ((x, whole.anchors[p][1]), (x, whole.anchors[q][1]))
    b = whole.box
    box = Rect(b.x0 - (SIDE + 8 if len(rows) > 2 else 0), b.y0, b.x1 + SIDE + 8, b.y1)
    return Part(whole.anchors, whole.vias, box)


def wrap(extents: Sequence[float], width: float) -> list[tuple[int, int]]:
    """Index ranges of rows of about equal width, from the extent of each block in one long row."""
    count = max(1, ceil(sum(extents) / width - 0.3))
    target = sum(extents) / count
    rows: list[tuple[int, int]] = []
    start, used = 0, 0.0
    for i, w in enumerate(extents):
        if used and used + w / 2 > target and len(rows) < count - 1:
            rows.append((start, i))
            start, used = i, 0.0
        used += w
    return [*rows, (start, len(extents))]


def _clear(a: Rect | None, b: Rect | None, gap: float) -> float:
    return 0.0 if a is None or b is None else a.x1 + gap - b.x0
