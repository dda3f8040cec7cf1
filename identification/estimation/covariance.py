"""Covariance of the unknowns of a stack, and which of the two the intervals of a fit take."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.support.arrays import Array
from identification.statistics import blocks
from identification.statistics.correlation import autocorrelation
from identification.statistics.growing_noise import growing_noise
from identification.statistics.whiteness import ljung_box
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


def inverse_information(
    stack: JointProblem, evaluations: Sequence[ResidualEvaluation], point: JointPoint
) -> Array:
    """Return the covariance that holds for white residuals, shape (n, n)."""
    root = information_root(stack, stack.normal(evaluations, point).factor)
    return np.asarray(root @ root.T)


def sandwich(
    stack: JointProblem,
    evaluations: Sequence[ResidualEvaluation],
    point: JointPoint,
    inverse: Array,
) -> Array:
    """Return the covariance of a stack that holds for coloured residuals too, shape (n, n).

    Parameters
    ----------
    inverse : ndarray, shape (n, n)
        Inverse information.
    """
    residual = np.concatenate([e.residual for e in evaluations])
    return blocks.sandwich(
        stack.projected(evaluations, point), residual, inverse, stack.prior[0] ** 2,
        stack.channels(evaluations), stack.readings(evaluations),
    )  # fmt: skip


def interval_covariance(
    stack: JointProblem, found: Sequence[ResidualEvaluation], point: JointPoint
) -> tuple[Array, str]:
    """Inverse information; the block sandwich where residuals are coloured, or grow."""
    stack = stack.loose(point)
    try:
        inverse = inverse_information(stack, found, point)
    except np.linalg.LinAlgError:
        return np.full((stack.n, stack.n), np.nan), ""
    coloured, grown = _coloured(stack, found), _grown(stack, found)
    if not (coloured or grown):
        return inverse, ""
    robust = sandwich(stack, found, point, inverse)
    why = "the residuals are coloured" if coloured else "; ".join(grown)
    return robust, f"{why}: the intervals are widened for it (robust)"


def _grown(stack: JointProblem, found: Sequence[ResidualEvaluation]) -> list[str]:
    """Return what is to be said of noise that grows with its reading."""
    said: dict[str, str] = {}
    for p, e in zip(stack.problems, found, strict=True):
        inside = p.data.mask("train")
        y = e.y[inside]
        for c, n in enumerate(p.data.names):
            noise = growing_noise(p.data.readings[inside, c] - y[:, c], y[:, c])
            if noise is not None:
                said.setdefault(n, noise.of(n))
    return list(said.values())


def _coloured(stack: JointProblem, found: Sequence[ResidualEvaluation], lags: int = 20) -> bool:
    """Whether a portmanteau test sees correlation in the residuals of a reading."""
    for p, e in zip(stack.problems, found, strict=True):
        rows = e.residual.size
        count = len(p.data.names)
        if p.window is not None or rows % max(count, 1):
            return True
        for r in e.residual.reshape(count, -1):
            n = r.size
            if n > 2 * lags and ljung_box(autocorrelation([r], lags), n, lags)[1] < 0.001:
                return True
    return False
