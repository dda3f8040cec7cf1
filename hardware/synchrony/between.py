"""Values between even samples: band-limited, with gaps and flags carried over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import i0

from bondgraph.support.arrays import FloatArray as Array
from hardware.contracts import Flag

HALF_TAPS = 16
BETA = 8.0
PIECE = 65536
INNER = slice(HALF_TAPS // 2, -HALF_TAPS // 2)
"""Columns of a kernel of half the length."""


@dataclass(frozen=True, slots=True, eq=False)
class Between:
    """Values at other instants.

    Attributes
    ----------
    values : ndarray
        (m,); NaN beyond the record and next to a missing sample.
    flags : ndarray
        (m,), all flags of the samples that a value is made of.
    error : float
        Largest difference (in the band that both kernels pass) to a kernel of half the length:
        what interpolation may have done, at most.
    """

    values: Array
    flags: NDArray[np.uint16]
    error: float


def between(values: Array, flags: NDArray[np.uint16], position: Array) -> Between:
    """Interpolate by a windowed sinc over 32 samples (Kaiser, beta 8; flat to 0.8 Nyquist).

    Parameters
    ----------
    values : ndarray
        (n,), even; NaN where a sample is missing.
    flags : ndarray
        (n,).
    position : ndarray
        (m,), wanted places in samples from the first.
    """
    n = values.size
    missing = ~np.isfinite(values)
    filled = values
    if missing.any():
        there = np.flatnonzero(~missing)
        filled = np.interp(np.arange(n), there, values[there])
    marks = flags | np.where(missing, np.uint16(Flag.LOST_BEFORE), np.uint16(0))
    padded = np.pad(filled, HALF_TAPS, mode="reflect", reflect_type="odd")
    spread = np.pad(marks, HALF_TAPS, mode="edge").astype(np.uint16)
    out = np.empty(position.size)
    short = np.empty(position.size)
    offsets = np.arange(1 - HALF_TAPS, HALF_TAPS + 1)
    whole = np.clip(np.floor(position).astype(np.intp), 0, max(n - 2, 0))
    for k in range(0, position.size, PIECE):
        begun = whole[k : k + PIECE]
        picked = padded[begun[:, None] + (offsets + HALF_TAPS)]
        part = (position[k : k + PIECE] - begun)[:, None] - offsets
        out[k : k + PIECE] = np.einsum("ij,ij->i", _taps(part, HALF_TAPS), picked)
        short[k : k + PIECE] = np.einsum(
            "ij,ij->i", _taps(part[:, INNER], HALF_TAPS // 2), picked[:, INNER]
        )
    # the flags of 32 neighbours at once: or them together in doubling runs
    run = spread
    for width in (1, 2, 4, 8, 16):
        run = run[:-width] | run[width:]
    touched = run[whole + 1]
    # a value that sits on a sample is that sample
    near = np.rint(position)
    on = np.abs(position - near) < 1e-9
    held = np.clip(near[on].astype(np.intp), 0, n - 1)
    touched[on] = marks[held]
    out[on] = short[on] = filled[held]
    lost = np.where(on, missing[np.clip(near.astype(np.intp), 0, n - 1)],
                    missing[whole] | missing[np.minimum(whole + 1, n - 1)])  # fmt: skip
    out[lost | (position < -1e-9) | (position > n - 1 + 1e-9)] = np.nan
    good = np.isfinite(out) & (touched == 0)
    error = float(np.abs(out - short)[good].max(initial=0.0))
    return Between(out, touched, error)


def _taps(distance: Array, half: int) -> Array:
    """Return weights that add up to one; the columns of `distance` are a sample apart."""
    # so their sines are equal but for the sign
    signs = 1.0 - 2.0 * (np.arange(distance.shape[1]) % 2)
    sines = np.sin(np.pi * distance[:, :1]) * signs
    sinc = np.divide(sines, np.pi * distance, out=np.ones_like(distance), where=distance != 0.0)
    inside = np.clip(1.0 - (distance / half) ** 2, 0.0, None)
    taps = sinc * i0(BETA * np.sqrt(inside)) * (np.abs(distance) < half)
    return np.asarray(taps / taps.sum(axis=1, keepdims=True))
