"""Forces averaged with outliers excluded, as the stack actuator thesis had to (section 8.3).

The thesis does not say what it took for an outlier. Here it is a reading more than `FAR` robust
standard deviations (1.4826 of the median distance) from the median of its `NEAR` neighbours and
from that of their pairs: a single reading that jumps, not the wandering of an unsteady output.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput

FAR = 3.5
"""Robust standard deviations from the median; 0.05 % of normal readings lie beyond."""
NEAR = 9
"""Readings of which the median is taken, the middle one among them."""
FEWEST = 5
ROUNDING = 1e-12
"""Share of a reading below which a distance is none."""
PLAIN = 0.1
"""Share of what is read up to which two equal distances are a step."""
SAME = 1e-6
"""Share by which two distances of one size may differ."""


@dataclass(frozen=True, slots=True)
class Averaged:
    """Readings at one voltage.

    Attributes
    ----------
    volts : float
        V.
    mean, uncertainty : float
        Of the readings kept; the standard error counts neighbours that hold together as fewer. Of
        equal ones it is that of their step, 0 if that is not known.
    kept, excluded : int
    """

    volts: float
    mean: float
    uncertainty: float
    kept: int
    excluded: int


def averaged(values: FloatArray, volts: float = float("nan"), step: float = 0.0) -> Averaged:
    """Return the mean of a plateau (n,) without its outliers.

    Parameters
    ----------
    values : ndarray
        (n,), readings.
    volts : float
        V.
    step : float
        Step in which readings come, in their unit; 0 if only they themselves may tell.

    Raises
    ------
    UnusableInput
        Fewer than `FEWEST` finite readings.

    Examples
    --------
    >>> averaged(np.array([1.0, 1.1, 0.9, 1.0, 1.05, 0.95, 4.0])).excluded
    1
    """
    x = np.asarray(values, dtype=np.float64)
    x = x[np.isfinite(x)]
    if x.size < FEWEST:
        raise UnusableInput(f"averaging: {x.size} readings; give at least {FEWEST} at each voltage")
    kept = x[~outlying(x, step)]
    error = _standard_error(kept) if np.ptp(kept) else step / float(np.sqrt(12.0))
    return Averaged(volts, float(kept.mean()), error, int(kept.size), int(x.size - kept.size))


def outlying(x: FloatArray, step: float = 0.0) -> NDArray[np.bool_]:
    """Return which of finite readings (n,), that come in steps of `step`, are outliers.

    Examples
    --------
    >>> int(np.flatnonzero(outlying(np.array([1.0, 1.1, 0.9, 1.0, 4.0, 1.05, 0.95])))[0])
    4
    """
    # a force that rises steadily is no outlier of its neighbours, so means of pairs count too
    reach = min(NEAR // 2, x.size - 1)
    wide = np.pad(x, reach, mode="reflect")
    shifted = [wide[k : k + x.size] for k in range(2 * reach + 1)]
    pairs = [0.5 * (shifted[k] + shifted[-1 - k]) for k in range(reach)]
    least = max(_step(x), step)
    return _far(x, np.median(shifted, axis=0), least) & _far(x, np.median(pairs, axis=0), least)


def _far(x: FloatArray, expected: FloatArray, step: float) -> NDArray[np.bool_]:
    off = np.abs(x - expected)
    # readings in whole steps may all agree: one step is never far
    spread = max(1.4826 * float(np.median(off)), step)
    return np.asarray(off > FAR * spread)


def _step(x: FloatArray) -> float:
    """Return the step in which readings come, 0 if they do not tell.

    Of two values only, one that came once is no proof of a step.
    """
    values, counts = np.unique(x, return_counts=True)
    if values.size < 2 or (values.size == 2 and counts.min() == 1):
        return 0.0
    return float(np.diff(values).min())


def _common_step(parts: list[FloatArray]) -> float:
    """Return the least distance from a middle reading that several share, 0 if none do.

    A distance that came once proves no step, and two do not if it is as large as what is read:
    two spikes of one size look so. Three do.
    """
    if not parts:
        return 0.0
    middle = [np.sort(x)[(x.size - 1) // 2] for x in parts]  # between two would be half a step
    off = np.sort(np.abs(np.concatenate([x - m for x, m in zip(parts, middle, strict=True)])))
    largest = max(float(np.abs(x).max()) for x in parts)
    off = off[off > ROUNDING * largest]
    plain = off[:-1][np.diff(off) <= SAME * off[1:]]
    plain = plain[plain <= PLAIN * float(np.abs(middle).max())]
    thrice = off[:-2][off[2:] - off[:-2] <= SAME * off[2:]]
    return float(min([*plain, *thrice], default=0.0))


def plateaus(volts: FloatArray, values: FloatArray, skip: int) -> tuple[Averaged, ...]:
    """Average every stretch of constant voltage; all together tell the step of the readings.

    Parameters
    ----------
    volts, values : ndarray
        (N,) voltage held at, and reading of, every sample.
    skip : int
        Samples at the beginning of a stretch that still settle.

    Raises
    ------
    UnusableInput
        There is no stretch that is long enough.
    """
    edges = np.flatnonzero(np.diff(volts)) + 1
    parts = np.split(np.arange(volts.size), edges)
    long = [p[skip:] for p in parts if p.size >= skip + FEWEST]
    if not long:
        raise UnusableInput(
            f"averaging: the voltage never stands for {skip + FEWEST} samples; hold it longer"
        )
    read = [values[p][np.isfinite(values[p])] for p in long]
    step = _common_step([x for x in read if x.size])
    return tuple(averaged(x, float(volts[p[0]]), step) for x, p in zip(read, long, strict=True))


def _standard_error(x: FloatArray) -> float:
    """Of the mean of an autoregression of first order; at least that of independent readings."""
    if x.size < 2:
        return float("inf")
    d = x - x.mean()
    power = float(d @ d)
    r = float(d[1:] @ d[:-1]) / power if power else 0.0
    r = min(max(r, 0.0), 0.95)
    return float(np.sqrt(power / (x.size - 1) / x.size * (1.0 + r) / (1.0 - r)))
