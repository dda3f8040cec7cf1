"""The shape class of a profile, and the interval it gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import FloatArray

SHAPES = ("two-sided", "open below", "open above", "flat", "multimodal", "at a bound")


@dataclass(frozen=True, slots=True)
class Side:
    """How a profile ends on one side: "closed", "open" (limit of the search) or "bound"."""

    end: str
    reached: float


def read_shape(
    x: FloatArray, rise: FloatArray, threshold: float, sides: Sequence[Side]
) -> tuple[tuple[float, float], str]:
    """Return ends of the interval in the coordinate and the shape class."""
    base = float(min(rise.min(), 0.0))
    inside = np.flatnonzero(rise - base <= threshold)
    low = _crossing(x, rise - base, int(inside[0]), -1, threshold)
    high = _crossing(x, rise - base, int(inside[-1]), 1, threshold)
    below, above = (s.end for s in sides)
    interval = (
        _end(below, low, sides[0].reached, -np.inf),
        _end(above, high, sides[1].reached, np.inf),
    )
    if _minima(rise, threshold) > 1:
        return interval, "multimodal"
    if (low is None and below == "bound") or (high is None and above == "bound"):
        # a bound at which nothing has risen yet does not close the interval by the data
        return interval, "at a bound"
    opened = (low is None, high is None)
    shape = {
        (False, False): "two-sided",
        (True, False): "open below",
        (False, True): "open above",
    }.get(opened, "flat")
    if shape == "flat" and float(np.ptp(rise)) > 0.5 * threshold:
        shape = "open above" if rise[0] > rise[-1] else "open below"
    return interval, shape


def _end(side: str, crossing: float | None, reached: float, infinite: float) -> float:
    if crossing is not None:
        return crossing
    return reached if side == "bound" else float(infinite)


def _crossing(x: FloatArray, y: FloatArray, i: int, step: int, level: float) -> float | None:
    """Return where the square root of the rise meets that of the level; None at the edge."""
    j = i + step
    if not 0 <= j < x.size:
        return None
    a, b = np.sqrt(max(y[i], 0.0)), np.sqrt(max(y[j], 0.0))
    return float(x[i] + (x[j] - x[i]) * (np.sqrt(level) - a) / max(b - a, 1e-300))


def _minima(rise: FloatArray, threshold: float) -> int:
    """Count valleys separated by a hill of a tenth of the threshold."""
    hill = 0.1 * threshold
    count, lowest, highest, falling = 0, float(rise[0]), float(rise[0]), True
    for v in map(float, rise[1:]):
        lowest, highest = min(lowest, v), max(highest, v)
        if falling and v > lowest + hill:
            count, falling, highest = count + 1, False, v
        elif not falling and v < highest - hill:
            falling, lowest = True, v
    return count + falling if rise[-1] <= lowest + hill and falling and rise.size > 1 else count
