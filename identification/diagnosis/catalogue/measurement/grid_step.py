"""The step of a grid that readings lie on, from the readings alone."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import Array

FLOAT32 = 2.4e-7
"""Rounding of single precision, four times over, relative to the largest value."""
EVEN = 0.12
"""Largest rms distance of the values from the grid, in steps; 0.29 if there is none."""
DECIMALS = 12
FEWEST = 6
"""Distinct values below which a grid is a coincidence, unless every one was read often."""
OFTEN = 25


def quantisation_step(readings: Array) -> float | None:
    """Return the distance of neighbouring values of a quantised reading; None if there is none.

    Gaps between the distinct values are whole multiples of the step. Values closer than single
    precision resolves count as one, and a step of a text file's last decimal is found where the
    converter's own is too fine to show.

    Parameters
    ----------
    readings : ndarray, shape (N,)

    Examples
    --------
    >>> quantisation_step(np.round(np.sin(np.arange(200.0)) / 0.25) * 0.25)
    0.25
    """
    y = np.asarray(readings, float)
    y = y[np.isfinite(y)]
    if y.size < 2 * FEWEST:
        return None
    values = _merged(np.unique(y))
    if values.size < (3 if y.size >= OFTEN * values.size else FEWEST):
        return None
    gaps = np.diff(values)
    candidates = np.unique(np.quantile(gaps, (0.5, 0.2, 0.05, 0.0)))[::-1]
    for first in candidates:
        step = _refined(gaps, float(first))
        if step is not None and _on_grid(values, step, EVEN):
            return step
    return _last_decimal(values)


def _merged(values: Array) -> Array:
    """Rising values, those within the precision of a float32 taken as one."""
    tolerance = FLOAT32 * float(np.abs(values).max())
    new = np.concatenate([[True], np.diff(values) > tolerance])
    return np.asarray(values[new])


def _refined(gaps: Array, step: float) -> float | None:
    """Improve a step from all gaps; None if these are far too wide for it to be told."""
    for _ in range(3):
        counts = np.round(gaps / step)
        if not counts.all():
            return None
        if np.median(counts) > 200:
            return None
        step = float(gaps.sum() / counts.sum())
    return step


def _on_grid(values: Array, step: float, tolerance: float) -> bool:
    """Whether the values lie on an even grid of this step, whatever its origin."""
    turn = 2 * np.pi * (values - values[0]) / step
    centre = np.angle(np.exp(1j * turn).mean())
    away = np.angle(np.exp(1j * (turn - centre))) / (2 * np.pi)
    return bool(np.sqrt(np.mean(away**2)) < tolerance)


def _last_decimal(values: Array) -> float | None:
    """Step of one in the last decimal, if the values have few decimals."""
    largest, span = float(np.abs(values).max()), float(np.ptp(values))
    for k in range(-DECIMALS, DECIMALS + 1):
        step = 10.0**-k
        if step > span / FEWEST:
            continue
        if largest * FLOAT32 > 0.3 * step:
            return None
        away = values / step - np.round(values / step)
        if np.abs(away).max() < 0.01 + FLOAT32 * largest / step:
            return step
    return None
