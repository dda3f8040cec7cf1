"""Frequency bands in which the residual rises above the noise floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.localisation.recording.scan import gathered

BANDS = 24
HANN_FREEDOM = 1.5


@dataclass(frozen=True)
class Band:
    """A band with its excess.

    Attributes
    ----------
    share, part : float
        Of the residual's power, and of the width of the spectrum.
    times : float
        Mean power in the band over the floor's.
    z : float
        Standard errors above the floor.
    """

    low: float
    high: float
    share: float
    part: float
    times: float
    z: float


def spectrum(residual: Array, floor: float, dt: float) -> tuple[Array, Array]:
    """Return frequencies (Hz, without zero) and power over a white floor's, shape (n // 2,).

    White noise at the floor has power 1 at every frequency.
    """
    r = residual - residual.mean()
    window = np.hanning(r.size)
    power = np.abs(np.fft.rfft(window * r)) ** 2 / (np.sum(window**2) * floor**2)
    return np.fft.rfftfreq(r.size, dt)[1:], power[1:]


def bands(residual: Array, floor: float, dt: float, most: int = 2) -> tuple[Band, ...]:
    """Find up to `most` bands that carry more than their share of the residual, strongest first.

    Parameters
    ----------
    residual : ndarray, shape (n,), SI
        Consecutive samples.
    floor : float, SI
        Standard deviation of the noise.
    """
    if residual.size < 64 or not np.ptp(residual) > 0:
        return ()
    f, power = spectrum(residual, floor, dt)
    edges = np.geomspace(f[0], f[-1] * 1.0001, BANDS + 1)
    index = np.clip(np.searchsorted(edges, f, side="right") - 1, 0, BANDS - 1)
    total = np.bincount(index, power, BANDS)
    count = np.bincount(index, minlength=BANDS).astype(float)
    everything = float(power.sum())
    found = []
    for a, b in gathered(total, count, most):
        inside = (index >= a) & (index <= b)
        n = int(inside.sum())
        if n:
            times = float(power[inside].mean())
            share = float(power[inside].sum()) / everything
            z = (times - 1.0) * float(np.sqrt(n / HANN_FREEDOM))
            ends_of = (float(f[inside][0]), float(f[inside][-1]))
            found.append(Band(*ends_of, share, n / f.size, times, z))
    return tuple(found)
