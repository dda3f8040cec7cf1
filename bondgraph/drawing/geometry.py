"""Points, boxes and the cutting of wires at boxes; y grows downwards as in SVG."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Rect:
    """Axis-parallel box from (x0, y0) to (x1, y1)."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def width(self) -> float:
        """Extent in x."""
        return self.x1 - self.x0

    @property
    def height(self) -> float:
        """Extent in y."""
        return self.y1 - self.y0

    def shifted(self, dx: float, dy: float) -> Rect:
        """Move the box."""
        return Rect(self.x0 + dx, self.y0 + dy, self.x1 + dx, self.y1 + dy)

    def grown(self, by: float) -> Rect:
        """Add a margin on all sides."""
        return Rect(self.x0 - by, self.y0 - by, self.x1 + by, self.y1 + by)

    def overlaps(self, other: Rect) -> bool:
        """Whether the interiors meet."""
        return (
            self.x0 < other.x1 and other.x0 < self.x1 and self.y0 < other.y1 and other.y0 < self.y1
        )

    def contains(self, p: Point) -> bool:
        """Whether a point lies in the box or on its border."""
        return self.x0 <= p[0] <= self.x1 and self.y0 <= p[1] <= self.y1

    def exit(self, a: Point, b: Point) -> float | None:
        """Share of the segment a-b after which it is outside for good; None if it never is in."""
        enter, leave = 0.0, 1.0
        for start, end, low, high in (
            (a[0], b[0], self.x0, self.x1),
            (a[1], b[1], self.y0, self.y1),
        ):
            d = end - start
            if abs(d) < 1e-12:
                if not low <= start <= high:
                    return None
                continue
            near, far = sorted(((low - start) / d, (high - start) / d))
            enter, leave = max(enter, near), min(leave, far)
        return leave if enter <= leave else None


def hull(boxes: Iterable[Rect]) -> Rect:
    """Smallest box around boxes; the empty box at the origin for none."""
    found = list(boxes)
    if not found:
        return Rect(0.0, 0.0, 0.0, 0.0)
    return Rect(
        min(b.x0 for b in found),
        min(b.y0 for b in found),
        max(b.x1 for b in found),
        max(b.y1 for b in found),
    )


def cut_start(path: Sequence[Point], shape: Sequence[Rect]) -> tuple[Point, ...]:
    """Drop the beginning of a path inside `shape` (a union of boxes)."""
    points = list(path)
    while len(points) > 2 and any(r.contains(points[1]) for r in shape):
        points.pop(0)
    a, b = points[0], points[1]
    shares = [s for r in shape if (s := r.exit(a, b)) is not None]
    t = max(shares, default=0.0)
    if t >= 1.0:  # nothing would be left of it: the boxes touch
        t = 0.0
    points[0] = (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]))
    return tuple(points)


def cut(path: Sequence[Point], start: Sequence[Rect], end: Sequence[Rect]) -> tuple[Point, ...]:
    """Keep the path between two shapes."""
    forward = cut_start(path, start)
    return cut_start(forward[::-1], end)[::-1]
