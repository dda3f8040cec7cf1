"""Least squares for the steering mirror's model: Levenberg-Marquardt on the lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from tests.proof.published.mirror_lines import FloatArray, Spectra
from tests.proof.published.mirror_model import MirrorModel, Modes

SMALLEST = 1e-9
LARGEST = 1e4


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A parameter vector and its mean square of weighted residuals (1 is noise and floor)."""

    p: FloatArray
    cost: float
    iterations: int


def cost(model: MirrorModel, p: FloatArray, data: Sequence[Spectra]) -> float:
    """Mean square of weighted residuals; infinite where the model has no steady state."""
    total, modes = 0.0, _by_drive(model, p, data)
    for e in data:
        try:
            y = model.settled(p, e, modes[model.drive(e)]).y
        except UnusableInput:
            return float("inf")
        total += float((e.weight * np.abs(e.y - y) ** 2).sum())
    return total / sum(e.y.size for e in data)


def fitted(
    model: MirrorModel,
    p: FloatArray,
    data: Sequence[Spectra],
    free: NDArray[np.intp],
    *,
    iterations: int = 20,
    damping: float = 1e-3,
    stop: float = 3e-3,
) -> Fitted:
    """Return the least squares fit of the parameters at the places `free`.

    Parameters
    ----------
    damping : float
        Of the first step, relative to the diagonal of the normal equations.
    stop : float
        Relative decrease of the cost that ends the fit.
    """
    now, done = cost(model, p, data), 0
    while done < iterations:
        matrix, slope = _normal(model, p, data, free)
        size = np.sqrt(np.diag(matrix)) + 1e-9 * np.sqrt(np.diag(matrix).max())
        before = now
        while True:
            scaled = matrix / size[:, None] / size + damping * np.eye(free.size)
            step = np.linalg.solve(scaled, slope / size) / size
            trial = p.copy()
            trial[free] += step
            then = cost(model, trial, data)
            if then < now:
                p, now, damping = trial, then, max(damping / 6.0, SMALLEST)
                break
            damping = max(10.0 * damping, 1e-6)
            if damping > LARGEST:
                return Fitted(p, now, done)
        done += 1
        if now > (1.0 - stop) * before:
            break
    return Fitted(p, now, done)


def _by_drive(model: MirrorModel, p: FloatArray, data: Sequence[Spectra]) -> dict[float, Modes]:
    return {a: model.modes(p, a) for a in {model.drive(e) for e in data}}


def _normal(
    model: MirrorModel, p: FloatArray, data: Sequence[Spectra], free: NDArray[np.intp]
) -> tuple[FloatArray, FloatArray]:
    """Return the normal equations of the weighted residuals."""
    modes = _by_drive(model, p, data)
    matrix: Any = 0.0
    slope: Any = 0.0
    for e in data:
        y, j = model.sensitivities(p, e, modes[model.drive(e)])
        root = np.sqrt(e.weight)
        rows = (root * j[free]).reshape(free.size, -1)
        left = (root * (e.y - y)).ravel()
        parts = np.hstack((rows.real, rows.imag))
        matrix = matrix + parts @ parts.T
        slope = slope + parts @ np.concatenate((left.real, left.imag))
    return np.asarray(matrix), np.asarray(slope)
