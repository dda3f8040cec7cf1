"""Baseline: a black box that learns the residual of the nominal model, and names nothing.

A ridge regression on lagged commands and simulated readings, their squares and cubes (a truncated
Volterra model without cross terms); the ridge is chosen on the last quarter of the training part.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.arrays import FloatArray as Array

LAGS = (0, 1, 2, 3, 5, 8, 12, 18, 27, 40)
RIDGES = tuple(10.0**k for k in range(-6, 5))


def black_box(inputs: Array, residual: Array, floor: Array, train: NDArray[np.bool_]) -> Array:
    """Learn the residual on the training part; returns what is left of it over the floor.

    Parameters
    ----------
    inputs : ndarray, shape (N, k)
        Commands and simulated readings; nothing that was measured.
    residual : ndarray, shape (N, n_y)
        Measured less simulated.
    floor : ndarray, shape (n_y,)
        Standard deviation of the noise of each reading.
    train : ndarray of bool, shape (N,)

    Returns
    -------
    ndarray, shape (N, n_y)
    """
    columns = features(inputs, train)
    target = residual / floor
    samples = np.flatnonzero(train)
    cut = (3 * samples.size) // 4
    early, late = samples[:cut], samples[cut:]
    errors = [
        float(
            np.mean((target[late] - columns[late] @ ridge(columns[early], target[early], r)) ** 2)
        )
        for r in RIDGES
    ]
    chosen = RIDGES[int(np.argmin(errors))]
    weights = ridge(columns[train], target[train], chosen)
    return np.asarray(target - columns @ weights)


def features(inputs: Array, train: NDArray[np.bool_]) -> Array:
    """Return a constant and lagged inputs with their squares and cubes, scaled on `train`."""
    n = inputs.shape[0]
    scaled = (inputs - inputs[train].mean(axis=0)) / (inputs[train].std(axis=0) + 1e-300)
    bent = np.hstack([scaled, scaled**2, scaled**3])
    lagged = [np.vstack([np.repeat(bent[:1], k, axis=0), bent[: n - k]]) for k in LAGS if k < n]
    return np.hstack([np.ones((n, 1)), *lagged])


def ridge(columns: Array, target: Array, weight: float) -> Array:
    """Ridge regression; the weight is relative to the mean square of the columns."""
    gram = columns.T @ columns
    size = float(np.trace(gram)) / gram.shape[0]
    return np.asarray(
        np.linalg.solve(gram + weight * size * np.eye(gram.shape[0]), columns.T @ target)
    )
