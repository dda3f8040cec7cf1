"""Noise floor of a reading, before any model: from a rest, else from the top of the spectrum."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from bondgraph.signals import Recording, Split

Array = np.ndarray
RELATIVE_LEAST = 1e-5


def noise_floor(recording: Recording, split: Split, sensors: tuple[str, ...]) -> dict[str, float]:
    """Return standard deviation of the noise of each sensor, SI.

    A rest of at least 200 samples gives it directly (less its slow trend). Otherwise the noise is
    taken as white at the level of the highest fifth of the spectrum, where plants answer least.
    Never less than the rounding of the converter or 1e-5 of the spread.
    """
    found = {}
    for n in sensors:
        y = np.asarray(recording[n])
        if split.rest is not None and split.rest.stop - (split.rest.start or 0) >= 200:
            sigma = _rest_level(y[split.rest])
        else:
            sigma = _white_level(y)
        found[n] = max(sigma, _rounding(y), RELATIVE_LEAST * float(y.std()), 1e-300)
    return found


def _rest_level(y: Array) -> float:
    t = np.linspace(-1, 1, y.size)
    left = y - np.polyval(np.polyfit(t, y, 2), t)
    # the drive may begin to move within the rest: a robust level does not see its last samples
    return min(float(left.std()), 1.4826 * float(np.median(np.abs(left - np.median(left)))))


def _white_level(y: Array) -> float:
    if y.size < 64:
        return float(np.abs(np.diff(y, 2)).std() / np.sqrt(6.0)) if y.size > 3 else 0.0
    _, density = welch(y, window=("kaiser", 14.0), nperseg=min(y.size // 4, 2048), detrend="linear")
    top = density[int(0.8 * density.size) : -1]
    return float(np.sqrt(np.median(top) * 0.5))


def _rounding(y: Array) -> float:
    steps = np.abs(np.diff(np.unique(y)))
    return float(steps.min() / np.sqrt(12.0)) if steps.size else 0.0
