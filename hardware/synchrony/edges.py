"""Clocks from the edges of a copy that is faster than a sample.

Such a copy tells which step of the drive was held at every instant, and nothing else: all time
maps that put every sample into its step are equally likely. Their set is what is known; its mean
and covariance are returned.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from bondgraph.support.arrays import FloatArray as Array
from hardware.synchrony.fit import AlignmentData, FittedTimeMap, TimeMapGuess
from hardware.synchrony.held import HeldColumns
from hardware.synchrony.time_map import TimeMap

GRID = 17
ZOOMS = 10
WORSE = float(stats.chi2.ppf(0.95, 2))


def by_edges(
    material: AlignmentData, held: HeldColumns, fitted: FittedTimeMap, one_ratio: bool
) -> tuple[TimeMapGuess, Array]:
    """Return the middle of the possible time maps and their covariance, as in `Alignment`.

    Parameters
    ----------
    material : AlignmentData
        A copy of steps.
    held : HeldColumns
        The steps.
    fitted : FittedTimeMap
        Right to less than half a step.
    one_ratio : bool
        The ratio is 1 exactly.
    """
    map_ = fitted.guess.map
    cost = _Cost.of(material, held, fitted)
    middle = float(material.time.mean())
    half_span = 0.5 * float(np.ptp(material.time))
    centre, half = map_.skew, 0.5 * held.step / half_span
    window = (-0.75 * held.step, 0.75 * held.step)
    if one_ratio:
        _, low, high = cost.along(map_, 0.0, middle, window)
        found = replace(map_, delay=map_.delay + 0.5 * (low + high))
        variances = np.zeros(map_.numbers.size)
        variances[0] = (high - low) ** 2 / 12.0
        return TimeMapGuess(found, 0.0), np.diag(variances)
    for _ in range(ZOOMS):
        skews = np.linspace(centre - half, centre + half, GRID)
        rows = np.array([cost.along(map_, e - map_.skew, middle, window) for e in skews])
        good = np.flatnonzero(rows[:, 0] <= rows[:, 0].min() + WORSE * cost.variance)
        if good.size >= GRID // 2:
            break
        centre = 0.5 * float(skews[good[-1]] + skews[good[0]])
        half = float(skews[good[-1]] - skews[good[0]]) + (skews[1] - skews[0])
        # only samples that such a change can put into another step still matter
        slack = 2.0 * half * half_span
        window = (
            max(float(rows[good, 1].min()) - slack, window[0]),
            min(float(rows[good, 2].max()) + slack, window[1]),
        )
        cost = cost.near(map_, centre - map_.skew, middle, window, slack)
    low, high = rows[good, 1], rows[good, 2]
    weight = high - low + 1e-15
    weight = weight / weight.sum()
    at, e = 0.5 * (low + high), skews[good]
    mean, mean_e = float(weight @ at), float(weight @ e)
    spacing = float(skews[1] - skews[0])
    var = float(weight @ ((at - mean) ** 2 + (high - low) ** 2 / 12.0))
    var_e = float(weight @ (e - mean_e) ** 2) + spacing**2 / 12.0
    both = float(weight @ ((at - mean) * (e - mean_e)))
    # from the middle of the record to its start
    delay = map_.delay + mean - (mean_e - map_.skew) * middle
    found = replace(map_, delay=delay, skew=mean_e)
    covariance = np.zeros((map_.numbers.size, map_.numbers.size))
    covariance[0, 0] = var - 2.0 * middle * both + middle**2 * var_e
    covariance[0, 1] = covariance[1, 0] = both - middle * var_e
    covariance[1, 1] = var_e
    return TimeMapGuess(found, 0.0), covariance


@dataclass(frozen=True, slots=True, eq=False)
class _Cost:
    """Squares left when samples are put into the step before, their own or the next."""

    time: Array
    step: float
    levels: Array
    values: Array
    variance: float

    @classmethod
    def of(cls, material: AlignmentData, held: HeldColumns, fitted: FittedTimeMap) -> _Cost:
        """Put every sample into the best of three steps; gain and offset from all."""
        b = held.columns[:, 0]
        step = held.step
        s = fitted.guess.map.to_drive(material.time)
        k = np.clip(np.floor(s / step).astype(int), 1, b.size - 2)
        near = np.stack([b[k - 1], b[k], b[k + 1]])
        gain, offset = float(fitted.coefficients[0]), float(fitted.coefficients[1])
        for _ in range(3):
            pick = np.abs(material.values - offset - gain * near).argmin(axis=0)
            level = near[pick, np.arange(k.size)]
            a = np.column_stack([level, np.ones(k.size)])
            (gain, offset), *_ = np.linalg.lstsq(a, material.values, rcond=None)
        rest = material.values - offset - gain * level
        return cls(
            material.time, step, gain * b + offset, material.values,
            float(np.mean(rest**2)) + 1e-300,
        )  # fmt: skip

    def near(
        self, map_: TimeMap, more: float, middle: float, window: tuple[float, float], slack: float
    ) -> _Cost:
        """Keep the samples whose step may change within a window of shifts (s)."""
        s = map_.to_drive(self.time) + more * (self.time - middle)
        p = s - np.floor(s / self.step) * self.step
        low, high = window[0] - slack, window[1] + slack
        kept = (-p >= low) | (self.step - p <= high)
        if low > 0.0 or high < 0.0:
            kept |= True
        return replace(self, time=self.time[kept], values=self.values[kept])

    def along(
        self, map_: TimeMap, more: float, middle: float, window: tuple[float, float]
    ) -> tuple[float, float, float]:
        """Return the least cost at a ratio, and between which shifts (s) at the middle it lies."""
        s = map_.to_drive(self.time) + more * (self.time - middle)
        k = np.clip(np.floor(s / self.step).astype(int), 1, self.levels.size - 2)
        p = s - k * self.step
        own, before, after = ((self.values - self.levels[k + j]) ** 2 for j in (0, -1, 1))
        # a shift d < -p puts the sample into the step before, d >= step - p into the next
        where = np.concatenate([-p, self.step - p])
        change = np.concatenate([own - before, after - own])
        order = np.argsort(where)
        where = where[order]
        total = float(before.sum()) + np.concatenate([[0.0], np.cumsum(change[order])])
        edges = np.concatenate([[-self.step], where, [self.step]])
        inside = (edges[1:] > window[0]) & (edges[:-1] < window[1])
        total = np.where(inside, total, np.inf)
        good = np.flatnonzero(total <= total.min() + WORSE * self.variance)
        low, high = float(edges[good[0]]), float(edges[good[-1] + 1])
        return float(total.min()), max(low, window[0]), min(high, window[1])
