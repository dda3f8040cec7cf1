"""What lies between the steps of a plant."""

from __future__ import annotations

import numpy as np

from hardware.simulators.arrays import Array


def linear(values: Array, position: Array) -> Array:
    """Interpolate linearly at positions counted in samples; ends are held."""
    k = np.clip(np.floor(position).astype(np.int64), 0, max(values.size - 2, 0))
    if values.size < 2:
        return np.asarray(values[k])
    s = np.clip(position - k, 0.0, 1.0)
    return np.asarray(np.where(s > 0.0, values[k] + s * (values[k + 1] - values[k]), values[k]))


def cubic(values: Array, position: Array) -> Array:
    """Four-point Lagrange interpolation at positions counted in samples; ends are held."""
    if values.size < 4:
        return linear(values, position)
    k = np.clip(np.floor(position).astype(np.int64), 1, values.size - 3)
    s = np.clip(position, 0.0, values.size - 1.0) - k
    a, b, c, d = (values[k + j] for j in (-1, 0, 1, 2))
    return np.asarray(
        -s * (s - 1.0) * (s - 2.0) / 6.0 * a
        + (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0 * b
        - (s + 1.0) * s * (s - 2.0) / 2.0 * c
        + (s + 1.0) * s * (s - 1.0) / 6.0 * d
    )
