"""What a waveform contains above a frequency."""

from __future__ import annotations

from typing import cast

import numpy as np
from scipy import fft

from bondgraph.support.arrays import FloatArray as Array


def above(wave: Array, rate: float, frequency: float) -> Array:
    """Return the absolute content of a waveform above a frequency (Hz), ``(n,)`` in its unit.

    The cosine transform (its lines lie at ``k rate / 2n``) mirrors the waveform at its ends, so a
    ramp that does not return has no false jump there. A burst shows with its full height, which
    the lines of a spectrum over a long record would hide.
    """
    lines = cast(Array, fft.dct(wave, type=2, norm="ortho"))
    lines[: int(np.floor(frequency * 2.0 * wave.size / rate * (1.0 + 1e-12))) + 1] = 0.0
    return np.abs(cast(Array, fft.idct(lines, type=2, norm="ortho", overwrite_x=True)))


def dominant(wave: Array, rate: float) -> float | None:
    """Return the strongest frequency of a waveform (Hz) if it carries half of the variance."""
    part = wave[: 1 << 18]
    if part.size < 8:
        return None
    power = np.abs(fft.rfft(part - part.mean())) ** 2
    total = float(power.sum())
    k = int(np.argmax(power))
    if total <= 0.0 or k == 0 or power[max(k - 1, 1) : k + 2].sum() < 0.5 * total:
        return None
    return k * rate / part.size
