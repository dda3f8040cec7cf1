"""Way of a bond that closes a ring: shortest path on a raster around labels, few turns."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from math import ceil

import numpy as np
from numpy.typing import NDArray

from bondgraph.drawing.geometry import Point, Rect, hull

STEP = 8.0
_TURN, _CROSS, _MARGIN = 4.0, 6.0, 18.0
_MOVES = ((1, 0), (-1, 0), (0, 1), (0, -1))
_Cell = tuple[int, int]


def route(
    start: Point,
    end: Point,
    boxes: Mapping[str, Sequence[Rect]],
    ends: tuple[str, str],
    wires: Iterable[Sequence[Point]],
) -> tuple[Point, ...]:
    """Points from `start` to `end`; a straight line if no free way exists."""
    page = hull([r for rs in boxes.values() for r in rs]).grown(6 * STEP)
    shape = (ceil(page.width / STEP) + 1, ceil(page.height / STEP) + 1)
    cost = np.ones(shape)
    for wire in wires:
        _trace(cost, wire, page)
    for n, rs in boxes.items():
        for r in rs:
            if n not in ends:
                _block(cost, r.grown(_MARGIN), page)
    cells = _search(cost, _cell(start, page), _cell(end, page))
    if not cells:
        return (start, end)
    return _points(cells, start, end, page)


def _cell(p: Point, page: Rect) -> _Cell:
    return (round((p[0] - page.x0) / STEP), round((p[1] - page.y0) / STEP))


def _block(cost: NDArray[np.float64], r: Rect, page: Rect) -> None:
    (i0, j0), (i1, j1) = _cell((r.x0, r.y0), page), _cell((r.x1, r.y1), page)
    cost[max(i0, 0) : i1 + 1, max(j0, 0) : j1 + 1] = np.inf


def _trace(cost: NDArray[np.float64], wire: Sequence[Point], page: Rect) -> None:
    top = np.array(cost.shape) - 1
    for a, b in pairwise(wire):
        n = max(ceil(max(abs(b[0] - a[0]), abs(b[1] - a[1])) / STEP), 1)
        for k in range(n + 1):
            p = (a[0] + (b[0] - a[0]) * k / n, a[1] + (b[1] - a[1]) * k / n)
            i, j = np.clip(_cell(p, page), 0, top)
            cost[i, j] = 1.0 + _CROSS


def _search(cost: NDArray[np.float64], start: _Cell, goal: _Cell) -> list[_Cell]:
    """Dijkstra over (cell, direction), turns cost extra."""
    best: dict[tuple[_Cell, int], float] = {}
    came: dict[tuple[_Cell, int], tuple[_Cell, int]] = {}
    heap: list[tuple[float, _Cell, int]] = [(0.0, start, -1)]
    while heap:
        d, cell, way = heapq.heappop(heap)
        if d > best.get((cell, way), np.inf):
            continue
        if cell == goal:
            return _back(came, (cell, way))
        for k, (di, dj) in enumerate(_MOVES):
            nxt = (cell[0] + di, cell[1] + dj)
            if not (0 <= nxt[0] < cost.shape[0] and 0 <= nxt[1] < cost.shape[1]):
                continue
            new = d + float(cost[nxt]) + (_TURN if way not in (-1, k) else 0.0)
            if new < best.get((nxt, k), np.inf):
                best[nxt, k] = new
                came[nxt, k] = (cell, way)
                heapq.heappush(heap, (new, nxt, k))
    return []


def _back(
    came: Mapping[tuple[_Cell, int], tuple[_Cell, int]], state: tuple[_Cell, int]
) -> list[_Cell]:
    cells = [state[0]]
    while state in came:
        state = came[state]
        cells.append(state[0])
    return cells[::-1]


def _points(cells: list[_Cell], start: Point, end: Point, page: Rect) -> tuple[Point, ...]:
    """Corners of the way, its first and last legs moved onto the anchors."""
    corners = [
        b
        for a, b, c in zip(cells, cells[1:], cells[2:], strict=False)
        if (b[0] - a[0], b[1] - a[1]) != (c[0] - b[0], c[1] - b[1])
    ]
    points = [(page.x0 + i * STEP, page.y0 + j * STEP) for i, j in corners]
    if points:
        points[0] = _onto(points[0], start, vertical=corners[0][0] == cells[0][0])
        points[-1] = _onto(points[-1], end, vertical=corners[-1][0] == cells[-1][0])
    return (start, *points, end)


def _onto(p: Point, anchor: Point, *, vertical: bool) -> Point:
    return (anchor[0], p[1]) if vertical else (p[0], anchor[1])
