"""White noise that belongs to sample numbers: the same however a record is cut into pieces."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hardware.simulators.arrays import Array

_BLOCK = 1024


def white(seed: int, first: int, count: int, stream: int = 0) -> Array:
    """Return normal numbers of samples `first`, ...; mean 0, standard deviation 1.

    Parameters
    ----------
    seed : int
        Not negative.
    first, count : int
        Number of the first sample (not negative) and how many.
    stream : int
        Independent numbers under one seed.

    Examples
    --------
    >>> bool((white(7, 1000, 50)[30:] == white(7, 1030, 20)).all())
    True
    """
    if count <= 0:
        return np.zeros(0)
    begin, end = first // _BLOCK, (first + count - 1) // _BLOCK
    parts = [_numbers(seed, stream, block) for block in range(begin, end + 1)]
    joined = parts[0] if len(parts) == 1 else np.concatenate(parts)
    at = first - begin * _BLOCK
    return joined[at : at + count].copy()


@lru_cache(maxsize=64)
def _numbers(seed: int, stream: int, block: int) -> Array:
    return np.random.default_rng([seed, stream, block]).standard_normal(_BLOCK)
