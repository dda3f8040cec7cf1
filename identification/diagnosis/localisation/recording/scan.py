"""Find the stretches of one axis in which the squared residual gathers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.statistics.blocks import block_index

BINS = 32
BLOCKS = 200
WIDEST = 0.6


@dataclass(frozen=True, eq=False)
class Stretch:
    """Samples of an axis that carry more than their share.

    Attributes
    ----------
    inside : ndarray of bool, shape (n,)
    share, part : float
        Of the squared residual, and of the samples.
    times : float
        Mean square inside.
    z : float
        Standard errors above the rest.
    """

    low: float
    high: float
    inside: Array
    share: float
    part: float
    times: float
    z: float


def bin_index(values: Array, bins: int = BINS, even: bool = False) -> tuple[Array, Array]:
    """Return the bin of each value, and the edges; equal counts unless `even`."""
    if even:
        edges = np.linspace(values.min(), values.max(), bins + 1)
    else:
        edges = np.unique(np.quantile(values, np.linspace(0, 1, bins + 1)))
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(edges.size - 2, 0))
    return index, edges


def densest(total: Array, count: Array) -> tuple[int, int] | None:
    """Return first and last of the adjacent bins whose sum lies furthest above the mean.

    Parameters
    ----------
    total, count : ndarray, shape (bins,)
        Sum of the squares and number of samples in each bin.

    Examples
    --------
    >>> densest(np.array([1.0, 1.0, 5.0, 6.0, 1.0]), np.ones(5))
    (2, 3)
    """
    n = float(count.sum())
    mean = float(total.sum()) / n if n else 0.0
    run = np.concatenate([[0.0], np.cumsum(total - mean * count)])
    seen = np.concatenate([[0.0], np.cumsum(count)])
    gain = run[None, :] - run[:, None]
    allowed = np.triu(np.ones(gain.shape, bool), 1)
    allowed &= (seen[None, :] - seen[:, None]) <= WIDEST * n
    gain = np.where(allowed, gain, -np.inf)
    first, after = np.unravel_index(int(np.argmax(gain)), gain.shape)
    return (int(first), int(after) - 1) if gain[first, after] > 0 else None


def gathered(total: Array, count: Array, most: int) -> Iterator[tuple[int, int]]:
    """Yield up to `most` runs of bins as `densest` finds them; each is emptied for the next."""
    for _ in range(most):
        if (ends := densest(total, count)) is None:
            return
        yield ends
        total[ends[0] : ends[1] + 1] = 0.0
        count[ends[0] : ends[1] + 1] = 0.0


def stretches(
    values: Array, square: Array, most: int = 2, *, even: bool = False, bins: int = BINS
) -> tuple[Stretch, ...]:
    """Find up to `most` stretches of an axis that carry more than their share.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The axis, sample by sample in the order of time.
    square : ndarray, shape (n,)
        Squared residual over the floor's.
    even : bool
        Bins of equal width (time) instead of equal counts.

    Returns
    -------
    tuple of Stretch
        The strongest first; empty if all is even.
    """
    index, edges = bin_index(values, bins, even)
    if edges.size < 3:
        return ()
    total = np.bincount(index, square, edges.size - 1)
    count = np.bincount(index, minlength=edges.size - 1).astype(float)
    found = []
    for a, b in gathered(total, count, most):
        inside = (index >= a) & (index <= b)
        found.append(_stretch(float(edges[a]), float(edges[b + 1]), inside, square))
    return tuple(found)


def _stretch(low: float, high: float, inside: Array, square: Array) -> Stretch:
    all_of_it = float(square.sum())
    share = float(square[inside].sum()) / all_of_it if all_of_it > 0 else 0.0
    times = float(square[inside].mean()) if inside.any() else 0.0
    return Stretch(low, high, inside, share, float(inside.mean()), times, contrast(square, inside))


def contrast(square: Array, inside: Array, blocks: int = BLOCKS) -> float:
    """By how many standard errors the mean inside exceeds the mean outside.

    The errors come from the sums over consecutive blocks of the record, so that a residual
    that is correlated over less than a block (n / 200 samples) does not pretend to be certain.
    """
    number = max(2, min(blocks, square.size // 8))
    block = block_index(square.size, number)
    means, variances = [], []
    for part in (inside, ~inside):
        s = np.bincount(block, square * part, number)
        n = np.bincount(block, part, number)
        if n.sum() == 0:
            return 0.0
        used = n > 0
        mean = float(s.sum() / n.sum())
        k = int(used.sum())
        spread = float(np.sum((s - mean * n)[used] ** 2)) / float(n.sum()) ** 2
        means.append(mean)
        variances.append(spread * k / (k - 1) if k > 1 else np.inf)
    error = float(np.sqrt(sum(variances)))
    return (means[0] - means[1]) / error if error > 0 else 0.0
