"""Unbroken stretches of scored samples, and correlations that never pair across a gap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput


def stretches(usable: Array) -> tuple[slice, ...]:
    """Return the unbroken runs of True.

    Examples
    --------
    >>> stretches(np.array([True, True, False, True]))
    (slice(0, 2, None), slice(3, 4, None))
    """
    padded = np.concatenate([[False], np.asarray(usable, bool), [False]])
    edges = np.flatnonzero(padded[1:] != padded[:-1])
    return tuple(slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True))


def pieces_of(values: Array, usable: Array | None = None) -> list[Array]:
    """Return the finite, usable stretches of `values`, the common mean removed.

    Parameters
    ----------
    values : ndarray, shape (N,)
    usable : ndarray of bool, shape (N,), optional
        Samples that count; all if not given.

    Raises
    ------
    UnusableInput
        If fewer than eight samples are left.
    """
    v = np.asarray(values, float)
    good = np.isfinite(v) if usable is None else np.isfinite(v) & usable
    count = int(good.sum())
    if count < 8:
        raise UnusableInput(f"{count} scored samples are too few to judge; score at least 8")
    mean = float(v[good].mean())
    return [v[s] - mean for s in stretches(good)]


def correlate(first: Sequence[Array], second: Sequence[Array], most: int) -> Array:
    """Return sums of ``first[t + k] second[t]`` for lags k = -most .. most, shape (2 most + 1,).

    Parameters
    ----------
    first, second : sequences of ndarray
        Stretches of equal lengths, pair by pair.
    """
    total = np.zeros(2 * most + 1)
    for a, b in zip(first, second, strict=True):
        size = next_fast_len(a.size + min(most, a.size), real=True)
        whole = irfft(rfft(a, size) * np.conj(rfft(b, size)), size)
        reach = min(most, a.size - 1)
        total[most : most + reach + 1] += whole[: reach + 1]
        if reach:
            total[most - reach : most] += whole[-reach:]
    return total


def autocorrelation(pieces: Sequence[Array], most: int) -> Array:
    """Autocorrelation at lags 0 .. most, shape (most + 1,); 1 at lag 0.

    The sums are divided by the whole count (the biased estimate, which is positive definite). A
    constant gives zeros beyond lag 0.
    """
    sums = correlate(pieces, pieces, most)[most:]
    if not sums[0] > 0:
        return np.concatenate([[1.0], np.zeros(most)])
    return np.asarray(sums / sums[0])
