"""Way of a bond that closes a ring, or of a signal: cheapest path on a raster around labels.

The raster has two layers, one for level and one for upright moves; changing the layer is a turn.
Labels are forbidden; wires may be crossed at a right angle, for a price, but not followed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, floor, sqrt

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from bondgraph.drawing.geometry import Point, Rect, hull
from bondgraph.support.arrays import FloatArray as _Array

STEP, _COARSE, _POINTS = 8.0, 20.0, 40_000
_HARD, _SOFT, _NEAR, _WINDOW = 7.0, 17.0, 10.0, 130.0
_TURN, _CROSS, _FOLLOW, _BESIDE, _TOUCH = 4.0, 10.0, 120.0, 5.0, 40.0
Wire = Sequence[Point]


def route(
    ends: tuple[str, str],
    anchors: Mapping[str, Point],
    boxes: Mapping[str, Sequence[Rect]],
    wires: Sequence[Wire],
    page: Rect,
) -> tuple[Point, ...]:
    """Return the points from anchor to anchor; a straight line if no free way exists."""
    start, end = anchors[ends[0]], anchors[ends[1]]
    whole = page.grown(7 * STEP)
    near = hull([*boxes[ends[0]], *boxes[ends[1]]]).grown(_WINDOW)
    close = _common(near, whole)
    for window, step in ((close, _step(close)), (whole, _step(whole)), (whole, STEP)):
        raster = _Raster.over(window, start, end, step)
        for n, rs in boxes.items():
            if n not in ends:
                for r in rs:
                    if r.overlaps(window):
                        raster.forbid(r)
        for n in ends:
            raster.enter(boxes[n])
        for wire in wires:
            raster.trace(wire)
        found = raster.cheapest(start, end)
        if found:
            return found
    return (start, end)


def _step(window: Rect) -> float:
    """Distance of lines: coarser in large windows, which then cost no more than small ones."""
    return min(max(STEP, sqrt(window.width * window.height / _POINTS)), _COARSE)


def _common(a: Rect, b: Rect) -> Rect:
    return Rect(max(a.x0, b.x0), max(a.y0, b.y0), min(a.x1, b.x1), min(a.y1, b.y1))


@dataclass(frozen=True, slots=True)
class _Raster:
    """Lines of the raster and the price of level moves, upright moves and turns at its points."""

    x: _Array
    y: _Array
    level: _Array
    upright: _Array
    turn: _Array
    step: float

    @classmethod
    def over(cls, window: Rect, start: Point, end: Point, step: float) -> _Raster:
        """Return an empty raster with lines through both anchors and beside them."""
        ends = (start, end)
        x = _lines(window.x0, window.x1, step, [p[0] + d for p in ends for d in (-8.5, 0.0, 8.5)])
        y = _lines(window.y0, window.y1, step, [p[1] + d for p in ends for d in (-8.0, 0.0)])
        shape = (x.size, y.size)
        return cls(x, y, np.ones(shape), np.ones(shape), np.full(shape, _TURN), step)

    def forbid(self, r: Rect) -> None:
        """Keep out of a label; passing close to it costs more."""
        soft = self._cells(r.grown(_SOFT))
        if soft is None:
            return
        for price in (self.level, self.upright):
            price[soft] += 1.0
        hard = self._cells(r.grown(_HARD))
        if hard is not None:
            for price in (self.level, self.upright):
                price[hard] = np.inf

    def enter(self, parts: Sequence[Rect]) -> None:
        """Let the way into its own label: straight, and through small lines only upright."""
        for r in parts:
            if (ring := self._cells(r.grown(15.0))) is not None:
                self.turn[ring] = np.inf
        for r in parts[1:]:
            if (small := self._cells(r.grown(5.0))) is not None:
                self.level[small] = np.inf
        b = parts[0]  # a level wire ends above or at the middle, for there is a name below
        if (body := self._cells(Rect(b.x0 + 4.0, b.y0 + 4.0, b.x1 - 4.0, b.y1 - 9.0))) is not None:
            self.turn[body] = _TURN
            self.level[body] = 1.0

    def trace(self, wire: Wire) -> None:
        """Make a wire costly to cross, to touch and to follow."""
        for k, (a, b) in enumerate(pairwise(wire)):
            box = Rect(min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1]))
            if self._cells(box.grown(_NEAR)) is None:
                continue
            if box.height < 1.0:
                self._straight(box, self.level, self.upright)
            elif box.width < 1.0:
                self._straight(box, self.upright, self.level)
            else:
                self._slanting(a, b)
            for tip in [p for p, last in ((a, k == 0), (b, k == len(wire) - 2)) if last]:
                if (c := self._cells(Rect(*tip, *tip).grown(_NEAR + 2))) is not None:
                    self.level[c] += _TOUCH  # the half arrow and the stroke
                    self.upright[c] += _TOUCH

    def cheapest(self, start: Point, end: Point) -> tuple[Point, ...]:
        """Return the corners of the cheapest way, anchors included; empty if there is none."""
        nx, ny = self.level.shape
        a, b = self._node(start), self._node(end)
        self.turn.flat[a], self.turn.flat[b] = 1e-3, 1e-3
        n = nx * ny
        cell = np.arange(n).reshape(nx, ny)
        dx, dy = np.diff(self.x)[:, None] / STEP, np.diff(self.y)[None, :] / STEP
        edges = (
            (cell[:-1], cell[1:], dx * (self.level[:-1] + self.level[1:]) / 2),
            (cell[:, :-1] + n, cell[:, 1:] + n,
             dy * (self.upright[:, :-1] + self.upright[:, 1:]) / 2),
            (cell, cell + n, self.turn),
        )  # fmt: skip
        tails, heads, prices = (np.concatenate([e[k].ravel() for e in edges]) for k in range(3))
        free = np.isfinite(prices)
        tails, heads, prices = tails[free], heads[free], prices[free]
        graph = csr_array(
            (np.tile(prices, 2), (np.r_[tails, heads], np.r_[heads, tails])), shape=(2 * n, 2 * n)
        )
        price, before = dijkstra(graph, indices=a, return_predecessors=True)
        if not np.isfinite(price[b]):
            return ()
        cells = [b]
        while cells[-1] != a:
            cells.append(int(before[cells[-1]]))
        points = [(float(self.x[c % n // ny]), float(self.y[c % n % ny])) for c in cells[::-1]]
        return _corners(points)

    def _straight(self, box: Rect, along: _Array, across: _Array) -> None:
        if (on := self._cells(box.grown(self.step / 2))) is not None:
            along[on] += _FOLLOW
            across[on] += _CROSS
            self.turn[on] += _TOUCH
        if (beside := self._cells(box.grown(_NEAR))) is not None:
            along[beside] += _BESIDE

    def _slanting(self, a: Point, b: Point) -> None:
        count = ceil(max(abs(b[0] - a[0]), abs(b[1] - a[1])) / self.step) + 1
        share = np.linspace(0.0, 1.0, count)
        for x, y in zip(a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), strict=True):
            if (c := self._cells(Rect(x, y, x, y).grown(self.step * 0.75))) is not None:
                self.level[c] += _CROSS / 2
                self.upright[c] += _CROSS / 2
                self.turn[c] += _TOUCH

    def _cells(self, r: Rect) -> tuple[slice, slice] | None:
        """Points of the raster in a box; None for none."""
        i0, i1 = self.x.searchsorted((r.x0, r.x1))
        j0, j1 = self.y.searchsorted((r.y0, r.y1))
        return None if i0 >= i1 or j0 >= j1 else (slice(i0, i1), slice(j0, j1))

    def _node(self, p: Point) -> int:
        i, j = int(np.abs(self.x - p[0]).argmin()), int(np.abs(self.y - p[1]).argmin())
        return i * self.y.size + j


def _lines(low: float, high: float, step: float, through: Sequence[float]) -> _Array:
    """Coordinates of lines about a step apart, some of them given."""
    regular = step * np.arange(floor(low / step), ceil(high / step) + 1)
    keep = np.ones(regular.size, dtype=bool)
    for v in through:
        keep &= np.abs(regular - v) >= step / 2
    return np.unique(np.concatenate((regular[keep], np.asarray(through, dtype=float))))


def _corners(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return ends and turns of a way over neighbouring points."""
    distinct = [p for k, p in enumerate(points) if k == 0 or p != points[k - 1]]
    inner = [
        q
        for p, q, r in zip(distinct, distinct[1:], distinct[2:], strict=False)
        if not (p[0] == q[0] == r[0] or p[1] == q[1] == r[1])
    ]
    return (distinct[0], *inner, distinct[-1])
