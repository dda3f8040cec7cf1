"""Loops that a signal draws over the argument of its port: area, closure, growth with speed."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.screening.port_history import PortHistory

BINS = 24
FEWEST = 5
WINDING = 1.3


@dataclass(frozen=True)
class Loops:
    """Loops over the argument.

    Attributes
    ----------
    area : float
        Mean area of a cycle over the area of its frame; positive if the signal is larger on the
        way up than on the way down.
    dissipation : float
        Mean power taken over the largest that its size allows (-1 to 1): positive takes energy,
        negative returns it.
    memory : float
        Share of the variance (linear part taken out) that the present argument leaves open.
    closure : float
        Share of that which the direction of motion settles: near one if every cycle goes the same
        two ways, whatever came before.
    speed_exponent : float or None
        How the area over the path grows with speed: 0 rate independent, 1 viscous; None where the
        record has no simple cycles over a range of speeds.
    count : int
        Cycles seen.
    """

    area: float
    dissipation: float
    memory: float
    closure: float
    speed_exponent: float | None
    count: int


def loops(past: PortHistory, signal: Array, *, flow: bool = False) -> Loops:
    """Return what the loops of `signal` over the argument of a port look like.

    Parameters
    ----------
    past : PortHistory
    signal : ndarray, shape (N,), SI
        Addition to the port's output.
    flow : bool
        The argument is a flow: power is signal times argument, not times its rate.

    Examples
    --------
    >>> t = 0.01 * np.arange(5000)
    >>> past = PortHistory(np.sin(t), np.sin(t), 0.01)
    >>> found = loops(past, np.cos(t))
    >>> round(found.dissipation, 2), round(found.area, 1)
    (1.0, 0.8)
    """
    x = past.argument
    rate = x if flow else past.rate
    signal = signal - signal.mean()
    size = float(np.sqrt(np.mean(signal**2) * np.mean(rate**2))) or 1.0
    spans, heights, areas, speeds, paths = [], [], [], [], []
    for part in cycles(x):
        inner, values = x[part], signal[part]
        span, height = float(np.ptp(inner)), float(np.ptp(values))
        if span < 0.05 * past.half or not height:
            continue
        middle = 0.5 * (values[1:] + values[:-1])
        around = float(np.sum(middle * np.diff(inner)))
        around += 0.5 * (values[-1] + values[0]) * float(inner[0] - inner[-1])
        spans.append(span)
        heights.append(height)
        areas.append(around)
        speeds.append(float(np.sqrt(np.mean(past.rate[part] ** 2))))
        paths.append(float(np.sum(np.abs(np.diff(inner)))))
    open_left, settled = _conditional(past, signal)
    shares = np.array(areas) / (np.array(spans) * np.array(heights))
    return Loops(
        float(shares.mean()) if spans else 0.0,
        float(np.mean(signal * rate)) / size,
        open_left,
        settled,
        _exponent(np.array(speeds), np.array(areas), np.array(paths), np.array(spans)),
        len(spans),
    )


def cycles(x: Array) -> list[slice]:
    """Cycles of `x`: from one upward crossing of its middle to the next, with a dead band.

    Examples
    --------
    >>> len(cycles(np.sin(0.1 * np.arange(200))))
    2
    """
    middle = 0.5 * (x.max() + x.min())
    band = 0.05 * float(np.ptp(x))
    level = np.where(x > middle + band, 1, np.where(x < middle - band, -1, 0))
    known = np.flatnonzero(level)
    if known.size < 2:
        return []
    signs = level[known]
    ups = known[1:][(signs[1:] > 0) & (signs[:-1] < 0)]
    return [slice(int(a), int(b) + 1) for a, b in pairwise(ups)]


def _conditional(past: PortHistory, signal: Array) -> tuple[float, float]:
    """Share of variance left by the argument, and how much of it the direction settles."""
    line = np.stack([past.argument - past.centre, np.ones(past.n)], axis=1)
    signal = signal - line @ np.linalg.lstsq(line, signal, rcond=None)[0]
    total = float(np.var(signal))
    if total <= 0:
        return 0.0, 1.0
    x = np.clip((past.argument - past.centre) / past.half, -1, 1)
    cell = np.minimum(((x + 1) / 2 * BINS).astype(int), BINS - 1)
    alone = _within(cell, signal, BINS) / total
    both = _within(2 * cell + (past.rate > 0), signal, 2 * BINS) / total
    return alone, 1.0 - both / alone if alone > 0 else 1.0


def _within(cell: Array, signal: Array, count: int) -> float:
    """Mean square about the mean of each cell's points."""
    number = np.maximum(np.bincount(cell, minlength=count), 1)
    mean = np.bincount(cell, signal, count) / number
    return float(np.mean((signal - mean[cell]) ** 2))


def _exponent(speeds: Array, areas: Array, paths: Array, spans: Array) -> float | None:
    """Slope of the loops' mean height on speed, both as logarithms, at equal span.

    Cycles with large reversals inside are left out: their small loops have another height.
    """
    heights = areas / np.where(paths > 0, paths, 1.0)
    good = (heights > 0) & (paths < WINDING * 2 * spans)
    if good.sum() < FEWEST:
        return None
    v = np.log(speeds[good])
    if np.ptp(v) < np.log(2.0):
        return None
    # loops of any kind grow with the span
    a = np.stack([v, np.log(spans[good]), np.ones(v.size)], axis=1)
    return float(np.linalg.lstsq(a, np.log(heights[good]), rcond=None)[0][0])
