"""Least squares with lower bounds, by active sets on orthogonal factors.

Sizes: m rows, n unknowns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from bondgraph.support.ops import FloatArray


def column_norms(matrix: FloatArray) -> FloatArray:
    """Return the Euclidean norm of every column, 1 for a column of zeros, shape (n,)."""
    norms = np.linalg.norm(matrix, axis=0)
    return np.where(norms > 0.0, norms, 1.0)


def bounded_least_squares(
    matrix: FloatArray, target: FloatArray, lower: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the minimiser of ``|matrix s - target|^2`` subject to ``s >= lower``.

    Columns are scaled to norm 1. Unknowns without a bound are projected out by QR; the rest is
    non-negative least squares (Lawson and Hanson) in ``s - lower``. The problem is convex, so this
    is the global minimum.

    Parameters
    ----------
    matrix : array
        Shape (m, n), m >= n, of full column rank.
    target : array
        Shape (m,).
    lower : array
        Shape (n,); -inf for no bound.

    Returns
    -------
    array
        s, shape (n,).
    array of bool
        Which unknowns lie on their bound, shape (n,).

    References
    ----------
    lawson1995

    Examples
    --------
    >>> s, on_bound = bounded_least_squares(np.eye(2), np.array([1.0, -1.0]), np.zeros(2))
    >>> s.tolist(), on_bound.tolist()
    ([1.0, 0.0], [False, True])
    """
    scale = column_norms(matrix)
    scaled = matrix / scale
    free = np.isneginf(lower)
    start = np.where(free, 0.0, lower)
    wanted = target - matrix @ start
    q, r = np.linalg.qr(scaled[:, free], mode="complete")
    n_free = int(free.sum())
    rest = q.T @ scaled[:, ~free]
    aim = q.T @ wanted
    excess = np.zeros(lower.size)
    excess[~free] = _non_negative(rest[n_free:], aim[n_free:])
    explained = aim[:n_free] - rest[:n_free] @ excess[~free]
    excess[free] = solve_triangular(r[:n_free], explained)
    return start + excess / scale, ~free & (excess == 0.0)


def _non_negative(matrix: FloatArray, target: FloatArray) -> FloatArray:
    """Return the non-negative least-squares solution, its free part solved by QR once more."""
    from scipy.optimize import lsq_linear, nnls

    n = matrix.shape[1]
    if n == 0:
        return np.zeros(0)
    try:
        solution: FloatArray = nnls(matrix, target, maxiter=30 * n)[0]
    except RuntimeError:  # it cycled: another active-set method
        found = lsq_linear(matrix, target, (0.0, np.inf), method="bvls", tol=1e-14)
        solution = np.where(found.active_mask == 0, found.x, 0.0)
    # Some releases of SciPy solve the free part through the normal equations, at half precision.
    passive = solution > 0.0
    again = np.linalg.lstsq(matrix[:, passive], target, rcond=None)[0]
    if np.all(again > 0.0):
        solution[passive] = again
    return solution
