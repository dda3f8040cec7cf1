"""Values of a record between its samples."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import Array


def between_samples(u: Array, n_sub: int) -> Array:
    """Band-limited values on a grid `n_sub` times finer, shape ((N - 1) * n_sub + 1, n_u).

    The record is mirrored at its ends before the Fourier interpolation, so that a jump between
    the last and the first sample does not ring.
    """
    from scipy.signal import resample  # late: it takes half a second

    n = u.shape[0]
    mirrored = np.concatenate([u, u[-2:0:-1]])
    fine = resample(mirrored, mirrored.shape[0] * n_sub, axis=0)
    return np.asarray(fine[: (n - 1) * n_sub + 1])
