"""The fine fit where lag and delay make a landscape of several hollows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hardware.synchrony.edges import by_edges
from hardware.synchrony.fit import AlignmentData, FittedTimeMap, TimeMapGuess, fit
from hardware.synchrony.held import HeldColumns

LAGS = (0.06, 0.15, 0.3, 0.6, 1.0, 1.6, 2.5, 4.0)
"""Starts for an unknown lag, in steps."""
EDGY = 0.3
"""Lag in steps below which the edges alone are tried as a start too."""
NO_WORSE = 15.0
"""Squares over the noise by which a hollow may be higher than the lowest and hold the truth."""
TRIED = 6


def settled(
    material: AlignmentData, held: HeldColumns, begun: TimeMapGuess, lag: float | None
) -> tuple[FittedTimeMap, tuple[FittedTimeMap, ...]]:
    """Return the best fit, and the others that explain the record as well.

    Parameters
    ----------
    material : AlignmentData
    held : HeldColumns
        Its drive.
    begun : TimeMapGuess
        With a smooth lag; right to a fraction of a step.
    lag : float, optional
        Declared lag (s); None: not known, then many starts.
    """
    step = held.step
    if lag is not None:
        fixed = replace(
            material, free=tuple(n for n in material.free if n != "lag"), beliefs=()
        )  # fmt: skip
        near = fit(fixed, begun, steps=10).guess
        return fit(material, replace(near, lag=max(lag, 0.0))), ()
    # with a drift the valley is narrow: only the whole record shows its floor
    few = material if "drift" in material.free else material.part(_bunches(material.time.size))
    tries = [
        fit(few, _later(begun, share * step - begun.lag), steps=10)
        for share in LAGS
    ]  # fmt: skip
    for _ in range(3):
        best = min(tries, key=lambda f: f.power)
        beside = [fit(few, _later(best.guess, k * step), steps=8)
                  for k in (-1, 1) if best.guess.lag + k * step > -0.7 * step]  # fmt: skip
        tries += beside
        if min(f.power for f in beside) >= best.power:
            break
    tries.sort(key=lambda f: f.power)
    starts = list[TimeMapGuess]()
    for one in tries:
        if one.power > tries[0].power * (1.0 + 4.0 * NO_WORSE * _colour(one) / one.rest.size):
            break
        if all(_apart(one.guess, g, material) > 1e-2 * step for g in starts):
            starts.append(one.guess)
    full = [fit(material, g, steps=20) for g in starts[:TRIED]]
    best = min(full, key=lambda f: f.power)
    if best.guess.lag < EDGY * step and held.hold == "zero" and "drift" not in material.free:
        fixed = replace(material, free=material.free[:-1], beliefs=())
        smooth = fit(fixed, begun, steps=10)
        edges, _ = by_edges(material, held, smooth, "skew" not in material.free)
        full.append(fit(material, TimeMapGuess(edges.map, 0.01 * step), steps=20))
        best = min(full, key=lambda f: f.power)
    worse = best.power * (1.0 + NO_WORSE * _colour(best) / best.rest.size)
    rivals = tuple(f for f in full if f is not best and f.power <= worse)
    return best, rivals


def _later(guess: TimeMapGuess, by: float) -> TimeMapGuess:
    """Return the guess with the lag and the delay longer by as much: much the same record."""
    return TimeMapGuess(replace(guess.map, delay=guess.map.delay + by), max(guess.lag + by, 1e-6))


def _apart(one: TimeMapGuess, other: TimeMapGuess, material: AlignmentData) -> float:
    t = material.time[[0, -1]]
    gap = float(np.abs(one.map.to_drive(t) - other.map.to_drive(t)).max())
    return max(gap, abs(one.lag - other.lag))


def _colour(fitted: FittedTimeMap) -> float:
    """Return by how much correlated neighbours make samples worth less."""
    rest = fitted.rest
    r = float(rest[1:] @ rest[:-1]) / (float(rest @ rest) + 1e-300)
    r = min(max(r, 0.0), 0.98)
    return (1.0 + r) / (1.0 - r)


def _bunches(n: int) -> NDArray[np.bool_]:
    """Choose an eighth of the samples in runs all over the record."""
    count = 32
    run = max(n // (8 * count), 64)
    return np.asarray((np.arange(n) % max(n // count, 1)) < run)
