"""A first guess of delay and ratio, from a delay of many samples down to less than one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import fftconvolve

from bondgraph.support.errors import UnusableInput
from hardware.synchrony.fit import AlignmentData, FittedTimeMap, TimeMapGuess, fit
from hardware.synchrony.held import HeldColumns
from hardware.synchrony.time_map import TimeMap

LEAST_CORRELATION = 0.5
MOST_ALIKE = 6
MOST_SCANNED = 150
BEYOND = 1.2
ALIKE = 4.0
"""Standard errors by which the best delay must beat another to be the only one."""


@dataclass(frozen=True, slots=True)
class Coarse:
    """Start of the fine fit.

    Attributes
    ----------
    guess : TimeMapGuess
    early : TimeMapGuess
        Of the first window alone: right there, whatever happened later.
    others : tuple of float
        Delays (s) that explain the record as well: a periodic drive looks the same a period later.
    """

    guess: TimeMapGuess
    early: TimeMapGuess
    others: tuple[float, ...]


def first_guess(
    material: AlignmentData,
    held: HeldColumns,
    expected: float,
    reach: float,
    skew: float,
    lag: float,
) -> Coarse:
    """Find the delay by correlation at the start, then the ratio in windows that double.

    Parameters
    ----------
    material : AlignmentData
        Evenly sampled time.
    held : HeldColumns
        Its first column is what is searched for.
    expected, reach : float
        Delay and how far from it to look (s).
    skew : float
        Largest ratio error thought possible.
    lag : float
        First guess of the lag (s).

    Raises
    ------
    UnusableInput
        If nothing in the record follows the drive.
    """
    step = float(np.median(np.diff(material.time)))
    size = _first_window(material, held, step, skew, abs(expected) + reach)
    early = slice(0, size)
    delays = _correlated(material.part(early), held, expected, reach, step, lag)
    begun = replace(material.part(early), free=("delay",), beliefs=())
    tried = [fit(begun, TimeMapGuess(TimeMap(d), lag), steps=8, most=2.0) for d in delays]
    tried.sort(key=lambda f: f.power)
    worse = 1.0 + ALIKE * np.sqrt(2.0 / size)
    alike = [f.guess for f in tried if f.power <= worse * tried[0].power]
    guess = min(alike, key=lambda g: abs(g.map.delay - expected))
    others = tuple(
        sorted({g.map.delay for g in alike if abs(g.map.delay - guess.map.delay) > 2.0 * step})
    )
    early_guess = guess
    loose: tuple[float, float] | None = None
    settled_once = False
    drifting = "drift" in material.free
    while True:
        free: tuple[str, ...] = ("delay", "skew")
        if drifting and 2 * size >= material.time.size:
            free += ("drift",)
        known = replace(material.part(slice(0, size)), free=free, beliefs=(("skew", 0.0, skew),))
        if loose is None:
            fitted = fit(known, guess, steps=0)  # the delay alone is settled there
        else:
            begin = _scanned(known, guess, loose, skew)
            fitted = fit(known, begin, steps=10, most=8.0)
            if abs(fitted.guess.map.skew) > BEYOND * skew:
                # nothing here tells the ratio, so it was bent to please a few samples
                fitted = fit(known, begin, steps=0)
        guess, loose = fitted.guess, _uncertain(known, fitted)
        if size >= material.time.size and settled_once:
            return Coarse(guess, early_guess, others)
        settled_once = True
        size = min(2 * size, material.time.size)


def _uncertain(material: AlignmentData, fitted: FittedTimeMap) -> tuple[float, float]:
    """Return the standard deviation of the skew and how the delay goes with it (s)."""
    j = fitted.jacobian[:, :2]
    variance = fitted.rms**2 + 1e-300
    h = j.T @ j / variance
    h[1, 1] += 1.0 / material.beliefs[0][2] ** 2
    spread = np.linalg.pinv(h, rcond=1e-15, hermitian=True)
    return float(np.sqrt(spread[1, 1])), float(spread[0, 1] / max(spread[1, 1], 1e-300))


def _scanned(
    material: AlignmentData, guess: TimeMapGuess, loose: tuple[float, float], skew: float
) -> TimeMapGuess:
    """Try ratios where the new end of the window may lie steps away from the prediction.

    Between two edges far apart nothing tells the ratio: the second must be looked for.
    """
    sd, along = loose
    step, span = material.held.step, float(material.time[-1] - material.time[0])
    wide = min(4.0 * sd, skew)
    most = min(int(np.ceil(wide * span / (0.5 * step))), MOST_SCANNED)
    if 3.0 * sd * span < 0.5 * step or most == 0:
        return guess
    tried = []
    for by in np.arange(-most, most + 1) * (wide / most):
        moved = replace(
            guess.map, skew=guess.map.skew + float(by), delay=guess.map.delay + along * float(by)
        )  # fmt: skip
        tried.append(fit(material, TimeMapGuess(moved, guess.lag), steps=0))
    best, stay = min(tried, key=lambda f: f.power), fit(material, guess, steps=0)
    return best.guess if best.power < 0.5 * stay.power else guess


def _first_window(
    material: AlignmentData, held: HeldColumns, step: float, skew: float, shift: float
) -> int:
    """Return how many samples to begin with: the drive has moved, the ratio does not matter yet."""
    n = material.time.size
    at = np.clip(material.time - material.time[0], 0.0, None)
    v = np.interp(at, np.arange(held.columns.shape[0]) * held.step,
                  held.columns[:, 0])  # fmt: skip
    total = float(np.abs(np.diff(v)).sum())
    if not total > 0.0:
        raise UnusableInput("clock: the drive is constant, so nothing marks the time; let it move")
    # the travel of two strokes at least, if there is as much
    travel = np.cumsum(np.abs(np.diff(v)))
    moved = int(np.searchsorted(travel, min(2.0 * float(np.ptp(v)), 0.5 * total))) + 1
    moved += int(2.0 * shift / step) + 64
    calm = int(0.25 / max(skew, 1e-12))
    return int(np.clip(max(moved, min(calm, n // 16)), min(256, n), n))


def _correlated(
    part: AlignmentData, held: HeldColumns, expected: float, reach: float, step: float, lag: float
) -> list[float]:
    """Return the best delay on the grid of the samples, and others that are hardly worse."""
    y = part.values - part.values.mean()
    n = y.size
    most = max(int(np.ceil(reach / step)), 2)
    grid = part.time[0] + expected + step * np.arange(-most, n + most)
    knots = np.arange(held.columns.shape[0]) * held.step
    late = lag + (0.5 * held.step if held.hold == "zero" else 0.0)
    v = np.interp(grid - late, knots, held.columns[:, 0])
    # least squares with offset and positive gain at every shift
    ones = np.ones(n)
    cross = fftconvolve(v, y[::-1], mode="valid")
    first = fftconvolve(v, ones, mode="valid")
    second = fftconvolve(v * v, ones, mode="valid")
    spread = np.maximum(second - first**2 / n, 1e-9 * float(np.ptp(held.columns[:, 0])) ** 2)
    likeness = cross / np.sqrt(spread * float(y @ y) + 1e-300)
    best = float(likeness.max())
    if not best >= LEAST_CORRELATION:
        raise UnusableInput(
            f"clock: nothing within {reach:g} s of the expected delay follows the drive "
            f"(correlation {best:.2f}); check channels and wiring, or look further"
        )
    inner = np.flatnonzero(
        (likeness[1:-1] >= likeness[:-2]) & (likeness[1:-1] >= likeness[2:])
    ) + 1  # fmt: skip
    # how much worse a shift of the grid alone can make a right delay look
    margin = float(1.0 - best) + float(np.abs(np.diff(likeness)).max())
    alike = inner[likeness[inner] >= best - margin] if inner.size else np.array([], int)
    alike = alike[np.argsort(np.abs(alike - most))][:MOST_ALIKE]
    alike = np.unique(np.append(alike, int(likeness.argmax())))
    return [float(expected + step * (k - most)) for k in alike]
