"""Triangles of matrices with many more rows than columns, by stretches that fit into the cache."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import Array

ROWS = 256
"""Rows of a stretch; more where there are many columns."""


def triangle(a: Array) -> Array:
    """Return the triangle R of a QR decomposition of `a`, signs of its rows aside.

    Stretches of rows are compressed first, then their triangles together (tall-skinny QR; Demmel
    et al., SIAM Journal on Scientific Computing 34 (2012) A206): as accurate as in one piece, and
    faster for long records.

    Parameters
    ----------
    a : ndarray, shape (..., M, n)

    Returns
    -------
    r : ndarray, shape (..., min(M, n), n)
    """
    *stack, height, n = a.shape
    rows = max(ROWS, 4 * n)
    count = height // rows
    if count < 2 or not n:
        return np.asarray(np.linalg.qr(a, mode="r"))
    split = count * rows
    done = np.asarray(np.linalg.qr(a[..., :split, :].reshape(*stack, count, rows, n), mode="r"))
    both = np.concatenate([done.reshape(*stack, -1, n), a[..., split:, :]], axis=-2)
    return np.asarray(np.linalg.qr(both, mode="r"))
