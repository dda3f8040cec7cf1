"""Shrink a least-squares problem of any number of rows to a triangle of a few dozen.

The triangle of a QR decomposition has the inner products of all columns of the tall matrix, so
every fit, residual and standard error can be had from it. Unlike the normal equations it does not
square the condition number. Blocks are folded in one by one: long records need little memory.

Sizes: N rows, k columns.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import final

import numpy as np

from bondgraph.support.ops import FloatArray

# Rows folded in at once: with a few dozen columns they stay in the processor's cache.
_ROWS = 1 << 10


@final
@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """A tall matrix, reduced.

    Attributes
    ----------
    triangle : array
        Shape (min(N, k), k), upper triangular, with the inner products of the tall matrix.
    lowest, highest : array
        Smallest and largest entry of each column, shape (k,).
    n_rows : int
        N.
    """

    triangle: FloatArray
    lowest: FloatArray
    highest: FloatArray
    n_rows: int


def reduce_blocks(blocks: Iterable[FloatArray]) -> Reduced:
    """Return the triangle of a matrix that comes in blocks of rows.

    Parameters
    ----------
    blocks : iterable of array
        Each of shape (rows, k), at least one.

    Returns
    -------
    Reduced
        Over all rows.

    Examples
    --------
    >>> tall = np.array([[3.0, 1.0], [4.0, 2.0]])
    >>> abs(reduce_blocks([tall[:1], tall[1:]]).triangle).round(12).tolist()
    [[5.0, 2.2], [0.0, 0.4]]
    """
    triangle: FloatArray | None = None
    lows, highs, n_rows = [], [], 0
    for block in blocks:
        for first in range(0, block.shape[0], _ROWS):
            rows = block[first : first + _ROWS]
            stacked = rows if triangle is None else np.vstack((triangle, rows))
            triangle = np.asarray(np.linalg.qr(stacked, mode="r"))
        lows.append(block.min(axis=0))
        highs.append(block.max(axis=0))
        n_rows += block.shape[0]
    if triangle is None:
        raise ValueError("no blocks of rows to reduce")
    return Reduced(triangle, np.min(lows, axis=0), np.max(highs, axis=0), n_rows)
