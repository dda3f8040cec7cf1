"""Interval of a mean over correlated samples: circular block bootstrap.

Politis and Romano, in: Exploring the Limits of Bootstrap, Wiley 1992, pp. 263-270.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.support.arrays import Array
from identification.statistics.correlation import autocorrelation
from identification.statistics.memory import memory

FEWEST_BLOCKS = 8
AT_ONCE = 4_000_000
"""Blocks drawn at once, for the sake of memory."""


def block_length(values: Array) -> int:
    """Return samples of a block: four memories of `values`, at least the cube root of N."""
    n = values.size
    r = autocorrelation([values - values.mean()], min(n - 1, max(10, n // 4)))
    return int(min(max(np.ceil(n ** (1 / 3)), np.ceil(4.0 * memory(r, n))), n))


def resampled_means(values: Array, length: int, draws: int = 2000, seed: int = 0) -> Array:
    """Means of `draws` resamples of whole blocks, shape (draws,).

    Parameters
    ----------
    values : ndarray, shape (N,)
    length : int
        Samples of a block.
    seed : int
        The same seed gives the same means.
    """
    n = values.size
    wrapped = np.concatenate([values, values[:length]])
    sums = np.concatenate([[0.0], np.cumsum(wrapped)])
    blocks = np.asarray(sums[length : length + n] - sums[:n]) / length
    count = max(1, -(-n // length))
    source = np.random.default_rng(seed)
    at_once = max(1, AT_ONCE // count)
    found = [
        blocks[source.integers(0, n, (min(at_once, draws - i), count))].mean(axis=1)
        for i in range(0, draws, at_once)
    ]
    return np.concatenate(found)


def mean_interval(
    values: Array | Sequence[float], level: float = 0.95, draws: int = 2000, seed: int = 0
) -> tuple[float, float]:
    """Interval of the mean of positive or signed correlated values.

    The spread of the resampled means is widened by ``sqrt(m / (m - 1))`` for m blocks. NaN when
    the record holds fewer than eight blocks: then it is too short beside its own memory.
    """
    v = np.asarray(values, float)
    if v.size < FEWEST_BLOCKS:
        return (float("nan"), float("nan"))
    length = block_length(v)
    count = v.size / length
    if count < FEWEST_BLOCKS:
        return (float("nan"), float("nan"))
    means = resampled_means(v, length, draws, seed)
    centre = float(v.mean())
    tail = 50.0 * (1.0 - level)
    low, high = np.percentile(means, [tail, 100.0 - tail]) - centre
    wider = float(np.sqrt(count / (count - 1.0)))
    return (centre + wider * float(low), centre + wider * float(high))
