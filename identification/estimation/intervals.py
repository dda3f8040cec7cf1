"""Which covariance the intervals of a fit take: information, or the block sandwich."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.covariance import information_root, sandwich
from identification.statistics.correlation import autocorrelation
from identification.statistics.growing_noise import growing_noise
from identification.statistics.whiteness import ljung_box
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import ResidualEvaluation


def interval_covariance(
    stack: JointProblem, found: Sequence[ResidualEvaluation], point: JointPoint
) -> tuple[Array, str]:
    """Inverse information; the block sandwich where residuals are coloured, or grow."""
    factor = stack.normal(found, point).factor
    if not np.isfinite(factor).all():
        return np.full((stack.n, stack.n), np.nan), ""
    root = information_root(stack, factor)
    inverse = root @ root.T
    coloured, grown = _coloured(stack, found), _grown(stack, found)
    if not (coloured or grown):
        return inverse, ""
    robust = sandwich(stack, found, point, inverse)
    why = "the residuals are coloured" if coloured else "; ".join(grown)
    return robust, f"{why}: intervals are robust ones (block sandwich)"


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
