"""Where wires meet wires and boxes, all segments at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bondgraph.drawing.geometry import Point, Rect


def count_crossings(wires: Sequence[Sequence[Point]]) -> int:
    """Return how often two different wires cross properly (not at shared ends)."""
    segments = [(*a, *b, float(k)) for k, w in enumerate(wires) for a, b in pairwise(w)]
    if len(segments) < 2:
        return 0
    s = np.asarray(segments)
    total = 0
    for i in range(len(s) - 1):
        rest = s[i + 1 :]
        ax, ay, bx, by, owner = s[i]
        one = _side(ax, ay, bx, by, rest[:, 0], rest[:, 1])
        two = _side(ax, ay, bx, by, rest[:, 2], rest[:, 3])
        three = _side(rest[:, 0], rest[:, 1], rest[:, 2], rest[:, 3], ax, ay)
        four = _side(rest[:, 0], rest[:, 1], rest[:, 2], rest[:, 3], bx, by)
        proper = (one * two < 0) & (three * four < 0) & (rest[:, 4] != owner)
        total += int(proper.sum())
    return total


class Obstacles:
    """Boxes of elements, to be asked whether a wire passes through any of them."""

    def __init__(self, boxes: Mapping[str, Sequence[Rect]]) -> None:
        flat = [(n, r) for n, rs in boxes.items() for r in rs]
        index = {n: k for k, n in enumerate(boxes)}
        self._index = index
        self._owner = np.array([index[n] for n, _ in flat], dtype=int)
        shape = (len(flat), 2)
        self._low = np.array([(r.x0, r.y0) for _, r in flat]).reshape(shape) + 1e-6
        self._high = np.array([(r.x1, r.y1) for _, r in flat]).reshape(shape) - 1e-6

    def hit(self, points: Sequence[Point], own: Sequence[str]) -> bool:
        """Whether a polyline passes through a box of an element that is not in `own`."""
        foreign = ~np.isin(self._owner, [self._index[n] for n in own])
        low, high = self._low[foreign], self._high[foreign]
        return any(_through(a, b, low, high) for a, b in pairwise(points))


def _through(a: Point, b: Point, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    enter, leave = np.zeros(len(low)), np.ones(len(low))
    for k in range(2):
        start, step = a[k], b[k] - a[k]
        if abs(step) < 1e-9:
            leave[(start <= low[:, k]) | (start >= high[:, k])] = -1.0
            continue
        s, t = (low[:, k] - start) / step, (high[:, k] - start) / step
        enter, leave = np.maximum(enter, np.minimum(s, t)), np.minimum(leave, np.maximum(s, t))
    return bool(np.any(enter < leave))


def _side(
    ax: float | NDArray[np.float64],
    ay: float | NDArray[np.float64],
    bx: float | NDArray[np.float64],
    by: float | NDArray[np.float64],
    px: float | NDArray[np.float64],
    py: float | NDArray[np.float64],
) -> NDArray[np.float64]:
    """Sign that says on which side of the line a-b the point p lies; 0 on it."""
    turn = np.asarray((bx - ax) * (py - ay) - (by - ay) * (px - ax))
    return np.where(np.abs(turn) < 1e-6, 0.0, np.sign(turn))
