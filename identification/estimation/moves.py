"""What a change of the readings does to the unknowns of a fit, in their standard errors.

A misfit that all samples share counts with the root of their number: by this, and not by its size
beside the noise of a sample, it is told whether sub-steps are enough.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.covariance import information_root
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import ResidualEvaluation

BIAS = 0.2
"""Doubling the sub-steps may move no unknown by more than this share of its standard error."""


@dataclass(frozen=True, eq=False)
class Moves:
    """Steps of the unknowns at a point.

    Attributes
    ----------
    error : ndarray, shape (n,)
        Standard errors of the scaled unknowns, with the misfit as it is.
    """

    error: Array
    _root: Array
    _jacobian: Array

    def by(self, change: Array, rows: slice = slice(None)) -> Array:
        """Return how many standard errors a change of these residuals moves each unknown."""
        moved = self._root @ (self._root.T @ (self._jacobian[rows].T @ change))
        return np.asarray(np.abs(moved / self.error))

    def most(self, change: Array, rows: slice = slice(None)) -> float:
        """Return the largest of them."""
        return float(self.by(change, rows).max(initial=0.0))


def moves_at(
    stack: JointProblem, now: Sequence[ResidualEvaluation], point: JointPoint
) -> Moves | None:
    """Return the steps at a point; None where the sensitivities are not finite."""
    factor = stack.normal(now, point).factor
    if not np.isfinite(factor).all():
        return None
    root = information_root(stack, factor)
    # standard errors with the misfit as it is, not with the noise that was expected
    level = max(1.0, float(np.sqrt(stack.cost(now, point))))
    error = level * np.linalg.norm(root, axis=1) + 1e-300
    return Moves(error, root, stack.projected(now, point))
