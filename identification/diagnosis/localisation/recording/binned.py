"""Mean squared residual over bins of one or two variables, with honest errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.localisation.recording.scan import bin_index
from identification.statistics.blocks import block_index

BLOCKS = 50
FEWEST = 8


@dataclass(frozen=True, eq=False)
class MisfitProfile:
    """Misfit along one variable.

    Attributes
    ----------
    centre, mean, error : ndarray, shape (bins,)
        Middle of each bin, mean square residual over the floor, and its standard error.
    """

    centre: Array
    mean: Array
    error: Array


def profile(values: Array, square: Array, bins: int = 20) -> MisfitProfile:
    """Mean of `square` over bins of `values` of equal counts.

    Parameters
    ----------
    values, square : ndarray, shape (n,)
        In the order of time; the error counts each of 50 consecutive blocks as one witness.
    """
    index, edges = bin_index(values, bins)
    number = max(edges.size - 1, 1)
    blocks = max(2, min(BLOCKS, values.size // 8))
    block = block_index(values.size, blocks)
    both = block * number + index
    s = np.bincount(both, square, blocks * number).reshape(blocks, number)
    n = np.bincount(both, minlength=blocks * number).reshape(blocks, number).astype(float)
    count = n.sum(axis=0)
    used = count > 0
    mean = np.where(used, s.sum(axis=0) / np.maximum(count, 1), np.nan)
    spread = np.sum((s - np.nan_to_num(mean) * n) ** 2, axis=0) / np.maximum(count, 1) ** 2
    centre = np.bincount(index, values, number) / np.maximum(count, 1)
    return MisfitProfile(centre[used], mean[used], np.sqrt(spread)[used])


@dataclass(frozen=True, eq=False)
class HeatMap:
    """Misfit over two variables.

    Attributes
    ----------
    x, y : ndarray, shape (columns + 1,) and (rows + 1,)
        Edges.
    mean : ndarray, shape (rows, columns)
        Mean square residual over the floor; NaN where the recording hardly went.
    """

    x: Array
    y: Array
    mean: Array


def heat_map(x: Array, y: Array, square: Array, columns: int = 20, rows: int = 14) -> HeatMap:
    """Mean of `square` over even bins of `x` and `y`, all of shape (n,)."""
    i, xe = bin_index(x, columns, even=True)
    j, ye = bin_index(y, rows, even=True)
    both = j * columns + i
    count = np.bincount(both, minlength=rows * columns)
    total = np.bincount(both, square, rows * columns)
    mean = np.where(count >= FEWEST, total / np.maximum(count, 1), np.nan)
    return HeatMap(xe, ye, mean.reshape(rows, columns))
