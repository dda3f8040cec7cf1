"""Forces averaged with outliers excluded, as the stack actuator thesis had to (section 8.3).

The thesis does not say what it took for an outlier. Here it is a reading more than `FAR` robust
standard deviations (1.4826 of the median distance) from the median of its `NEAR` neighbours: a
single reading that jumps, not the wandering of an output that is not steady.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput

FAR = 3.5
"""Robust standard deviations from the median; 0.05 % of normal readings lie beyond."""
NEAR = 9
"""Readings of which the median is taken, the middle one among them."""
FEWEST = 5


@dataclass(frozen=True, slots=True)
class Averaged:
    """Readings at one voltage.

    Attributes
    ----------
    volts : float
        V.
    mean, uncertainty : float
        Of the readings kept; the standard error counts neighbours that hold together as fewer.
    kept, excluded : int
    """

    volts: float
    mean: float
    uncertainty: float
    kept: int
    excluded: int


def averaged(values: FloatArray, volts: float = float("nan")) -> Averaged:
    """Return the mean of a plateau (n,) without its outliers.

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
    off = np.abs(x - median_filter(x, size=min(NEAR, x.size), mode="mirror"))
    # readings in whole steps may all agree: one step is never far
    steps = np.diff(np.unique(x))
    spread = max(1.4826 * float(np.median(off)), float(steps.min()) if steps.size else 0.0)
    kept = x[off <= FAR * spread]
    return Averaged(
        volts, float(kept.mean()), _standard_error(kept), int(kept.size), int(x.size - kept.size)
    )


def plateaus(volts: FloatArray, values: FloatArray, skip: int) -> tuple[Averaged, ...]:
    """Average every stretch of constant voltage.

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
    return tuple(averaged(values[p], float(volts[p[0]])) for p in long)


def _standard_error(x: FloatArray) -> float:
    """Of the mean of an autoregression of first order; at least that of independent readings."""
    if x.size < 2:
        return float("inf")
    d = x - x.mean()
    power = float(d @ d)
    r = float(d[1:] @ d[:-1]) / power if power else 0.0
    r = min(max(r, 0.0), 0.95)
    return float(np.sqrt(power / (x.size - 1) / x.size * (1.0 + r) / (1.0 - r)))
