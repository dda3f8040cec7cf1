"""Errors of length by what is not measured: dead path, a tilted beam, a beam beside the axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import FloatArray as Array


def dead_path_error(dead_path: float, index: ArrayLike, index_at_zero: float) -> Array:
    """Return the false displacement (m) that air along the dead path simulates since the zero.

    Parameters
    ----------
    dead_path : float
        Difference of the two arms when the counter was set to zero (m).
    index : array_like
        Refraction index now.
    index_at_zero : float
        Refraction index at the zero.

    Returns
    -------
    ndarray
        m; to be subtracted from what was measured. About -93 nm per K on 100 mm.
    """
    n = np.asarray(index, dtype=np.float64)
    return np.asarray((n - index_at_zero) * dead_path / n)


def cosine_error(displacement: ArrayLike, tilt: ArrayLike) -> Array:
    """Return what a beam tilted by `tilt` (rad) against the motion reads too little (m).

    Examples
    --------
    >>> round(float(cosine_error(4.9e-6, 1e-3)) * 1e12, 2)  # pm
    2.45
    """
    # 1 - cos without cancellation
    half = np.sin(0.5 * np.asarray(tilt, dtype=np.float64))
    return np.asarray(2.0 * half * half * np.asarray(displacement, dtype=np.float64))


def cosine_corrected(reading: ArrayLike, tilt: float) -> Array:
    """Displacement (m) along the motion from a reading along a beam tilted by `tilt` (rad)."""
    return np.asarray(np.asarray(reading, dtype=np.float64) / np.cos(tilt))


def abbe_error(offset: ArrayLike, rotation: ArrayLike) -> Array:
    """Return the false displacement (m) by a rotation (rad) of a mirror hit `offset` (m) off axis.

    Examples
    --------
    >>> round(float(abbe_error(1e-3, 10e-6)) * 1e9, 3)  # nm
    10.0
    """
    return np.asarray(np.asarray(offset, np.float64) * np.tan(np.asarray(rotation, np.float64)))
