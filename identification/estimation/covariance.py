"""Covariance of the unknowns of a stack: inverse information and block sandwich."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.support.arrays import Array
from identification.statistics.blocks import block_rows, block_scores, blocks_for, student
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import ResidualEvaluation


def information_root(stack: JointProblem, factor: Array) -> Array:
    """Return the inverse triangle of `JointProblem.normal`; ``root @ root.T`` is the covariance.

    The square of the triangle would leave unstable plants no digits. Nuisances that are switched
    off are known, and have no variance.
    """
    if not np.isfinite(factor).all():  # said here: LAPACK would print it
        raise np.linalg.LinAlgError("the sensitivities are not finite")
    lower, upper = stack.bounds
    free = upper > lower
    size = np.linalg.norm(factor[:, free], axis=0) + 1e-300
    root = np.zeros((stack.n, factor.shape[0]))
    root[free] = np.linalg.pinv(factor[:, free] / size, rcond=1e-15) / size[:, None]
    return root


def sandwich(
    stack: JointProblem,
    evaluations: Sequence[ResidualEvaluation],
    point: JointPoint,
    inverse: Array,
) -> Array:
    """Return the covariance that holds for coloured residuals too, shape (n, n).

    See `identification.statistics.blocks`. The priors keep their own part, so that numbers the
    data do not excite stay unknown.

    Parameters
    ----------
    inverse : ndarray, shape (n, n)
        Inverse information.
    """
    jacobian = stack.projected(evaluations, point)
    residual = np.concatenate([e.residual for e in evaluations])
    channels = stack.channels(evaluations)
    rows = block_rows(residual.size, channels, blocks_for(residual, channels))
    scores = block_scores(jacobian, residual, rows, inverse)
    middle = np.diag(stack.prior[0] ** 2) + scores.T @ scores
    return np.asarray(inverse @ middle @ inverse * student(len(rows)))
