"""Samples that a sensor lost without telling: the copy jumps ahead by whole samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from hardware.synchrony.alignment import SilentLoss
from hardware.synchrony.fit import AlignmentData, FittedTimeMap, TimeMapGuess, fit
from hardware.synchrony.held import HeldColumns

BLOCK = 64
SUSPECT = 3.0
"""Times the noise, in a block, that is no noise."""
LAGS = (1, 2, 4, 8, 16, 32, 64)
ALIKE = 0.4
"""Correlation that a filter before a converter may give its noise, but no more."""
EXPLAINED = 1.3
MOST = 2000
MOST_SKEW = 1e-3
MOST_GAPS = 50


def structured(fitted: FittedTimeMap) -> bool:
    """Return whether what is left of a fit is no noise: it goes with itself some samples later."""
    rest = fitted.rest - fitted.rest.mean()
    power = float(rest @ rest) + 1e-300
    alike = [float(rest[k:] @ rest[:-k]) / power for k in LAGS if rest.size > 2 * k]
    return max(alike, default=0.0) > ALIKE


def find_gaps(
    material: AlignmentData, held: HeldColumns, start: TimeMapGuess, lag: float | None = None
) -> tuple[SilentLoss, ...]:
    """Follow the record from its beginning; where it leaves the prediction, look how far it jumped.

    Gaps shorter than what the drive moves above the noise cannot be seen, and under a periodic
    drive a gap is known but for whole periods (the shortest is returned).

    Parameters
    ----------
    material : AlignmentData
        The copy; sample n at ``time[n]`` if none were lost.
    held : HeldColumns
        Its drive.
    start : TimeMapGuess
        Right at the beginning of the record.
    lag : float, optional
        Of the amplifier (s), where it is known.
    """
    step = float(np.median(np.diff(material.time)))
    n = material.time.size
    look = _look(material, held, step)
    good, found = look, list[SilentLoss]()
    beliefs: tuple[tuple[str, float, float], ...] = (("skew", 0.0, MOST_SKEW),)
    free: tuple[str, ...] = ("delay", "skew")
    if lag is None:
        free, beliefs = (*free, "lag"), (*beliefs, ("lag", start.lag, held.step))
    start = start if lag is None else replace(start, lag=lag)
    now = replace(material, free=free, beliefs=beliefs)
    best = fit(now.part(slice(0, good)), start, steps=15)
    noise = max(best.rms, 1e-12 * float(np.ptp(material.values)))
    while good < n and len(found) < MOST_GAPS:
        size = min(2 * good, n)
        rest = _predicted(now, best, slice(0, size))
        bad = _first_bad(rest, good, noise)
        if bad is None:
            good = size
            best = fit(now.part(slice(0, good)), best.guess, steps=8)
            continue
        # perhaps the prediction only reached too far: a gap is what no refit explains
        further = min(max(bad + look, good + BLOCK), n)
        again = fit(now.part(slice(0, further)), best.guess, steps=10)
        if again.rms <= EXPLAINED * noise:
            good, best = further, again
            continue
        gap = _jump(now, best, bad, look, noise, step)
        if gap is None:
            break
        found.append(gap)
        time = now.time.copy()
        time[gap.first :] += gap.missing * step
        now = replace(now, time=time)
        good = min(gap.first + look, n)
        best = fit(now.part(slice(0, good)), best.guess, steps=8)
    return tuple(found)


def _look(material: AlignmentData, held: HeldColumns, step: float) -> int:
    """Return how many samples the drive needs for a quarter of its stroke, wherever it is."""
    grid = np.arange(held.columns.shape[0]) * held.step
    v = np.interp(material.time, grid, held.columns[:, 0])
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(v)))])
    ahead = np.searchsorted(travel, travel + 0.25 * float(np.ptp(v)))
    there = ahead < v.size
    needed = int(np.max((ahead - np.arange(v.size))[there], initial=0))
    return int(np.clip(needed, 4 * BLOCK, max(material.time.size // 4, 4 * BLOCK)))


def _predicted(material: AlignmentData, best: FittedTimeMap, part: slice) -> Array:
    columns, _ = material.held.with_lag(best.guess.lag).at(
        best.guess.map.to_drive(material.time[part])
    )
    a = np.column_stack([columns, material.trend[part]])
    return np.asarray(material.values[part] - a @ best.coefficients)


def _first_bad(rest: Array, good: int, noise: float) -> int | None:
    """Return the first sample of the first two blocks in a row that are no noise."""
    first = good // BLOCK * BLOCK
    count = (rest.size - first) // BLOCK
    if count < 2:
        return None
    blocks = rest[first : first + count * BLOCK].reshape(count, BLOCK)
    bad = np.sqrt(np.mean(blocks**2, axis=1)) > SUSPECT * noise
    pairs = np.flatnonzero(bad[:-1] & bad[1:])
    return None if pairs.size == 0 else int(first + pairs[0] * BLOCK)


def _jump(
    material: AlignmentData, best: FittedTimeMap, bad: int, look: int, noise: float, step: float
) -> SilentLoss | None:
    """Return the whole number of samples that mends what follows, and where it begins."""
    n = material.time.size
    low, high = max(bad - look, 1), min(bad + 2 * look, n)
    if high - bad < 2 * BLOCK:
        return None
    y = material.values[low:high]
    at = material.time[low] + step * np.arange(high - low + MOST)
    columns, _ = material.held.with_lag(best.guess.lag).at(best.guess.map.to_drive(at))
    model = columns @ best.coefficients[: columns.shape[1]] + best.coefficients[-1]
    late = slice(high - low - min(look, high - bad - BLOCK), None)
    wanted = y[late]
    views = np.lib.stride_tricks.sliding_window_view(model, wanted.size)[late.start :][:MOST]
    cost = np.sqrt(np.mean((views - wanted) ** 2, axis=1))
    near = np.flatnonzero(cost <= max(SUSPECT * noise, 1.5 * float(cost.min())))
    if near.size == 0 or float(cost.min()) > 2.0 * SUSPECT * noise:
        return None
    missing = int(near[int(np.argmin(cost[near[near < near[0] + 3]]))])
    if missing == 0:
        return None
    before = (y - model[: y.size]) ** 2
    after = (y - model[missing : missing + y.size]) ** 2
    split = np.concatenate([[0.0], np.cumsum(before)]) + np.concatenate(
        [np.cumsum(after[::-1])[::-1], [0.0]]
    )
    return SilentLoss(low + int(np.argmin(split)), missing)
