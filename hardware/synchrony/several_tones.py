"""A delay and a hysteresis told apart by several tones."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.errors import UnusableInput


def delay_from_lags(frequencies: ArrayLike, lags: ArrayLike) -> tuple[float, float]:
    """Return delay (s) and phase (rad) of a plant without rate from its lags at several tones.

    A rate-independent plant lags by the same *phase* phi at every frequency, a delay of the sensor
    advances by the same *time*: ``lag = phi / (2 pi f) - delay``. Frequencies must share the
    amplitude and the delay (one trigger). Any rate dependence of the plant counts as delay.

    Parameters
    ----------
    frequencies : array, shape (F,), Hz
        At least 2 different ones.
    lags : array, shape (F,), s
        `Alignment.answer_lag` of each.

    Returns
    -------
    delay : float
        s.
    phase : float
        Of the plant, rad, positive when it lags.

    Raises
    ------
    UnusableInput
        If all frequencies are the same.
    """
    f, lag = np.asarray(frequencies, float), np.asarray(lags, float)
    if f.size < 2 or np.ptp(f) == 0.0:
        raise UnusableInput("delay: two different frequencies are needed")
    columns = np.column_stack((-np.ones(f.size), 1 / (2 * np.pi * f)))
    (delay, phase), *_ = np.linalg.lstsq(columns, lag, rcond=None)
    return float(delay), float(phase)
