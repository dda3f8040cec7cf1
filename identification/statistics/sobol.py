"""Even points in many dimensions."""

from __future__ import annotations

import warnings

import numpy as np

from bondgraph.support.arrays import FloatArray


def sobol(count: int, size: int, seed: int) -> FloatArray:
    """Return the first points of a scrambled Sobol sequence, shape (count, size)."""
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # balance needs powers of two, we do not
        return np.asarray(qmc.Sobol(size, seed=seed).random(count))
