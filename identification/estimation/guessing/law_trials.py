"""Sizes of nonlinear laws, which no linear response shows: tried on the free run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from identification.statistics.sobol import sobol
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import start_point
from identification.study.scaled import Free

DECADES = 2.0
SCALES = 3.0


def law_trials(
    stack: JointProblem,
    theta: Array,
    hidden: Sequence[int],
    seed: int,
    count: int = 32,
    best: int = 2,
) -> list[Array]:
    """Return unknowns with other sizes of the laws: none of them, then the best of `count`.

    Without the laws a Gauss-Newton step is a linear least-squares fit of their weights.

    Parameters
    ----------
    theta : ndarray, shape (n,)
        Where the other unknowns stay.
    hidden : sequence of int
        Unknowns of laws alone.
    """
    if not hidden:
        return []
    at = np.asarray(hidden, int)
    free = [stack.free[int(i)] for i in at]
    lower, upper = (b[at] for b in stack.bounds)
    unit = sobol(count, at.size, seed)
    points = np.tile(theta, (count + 1, 1))
    for i, f in enumerate(free):
        points[0, at[i]] = lower[i] if f.log else -f.start / f.scale
        points[1:, at[i]] = [_spread(f, x) for x in 2.0 * unit[:, i] - 1.0]
    points[:, at] = np.clip(points[:, at], lower, upper)
    costs = np.array([_misfit(stack, p) for p in points[1:]])
    order = [i for i in np.argsort(costs, kind="stable")[:best] if np.isfinite(costs[i])]
    return [points[0], *(points[1 + i] for i in order)]


def _spread(f: Free, x: float) -> float:
    """Theta of a value spread by `x` from -1 to 1: decades of sizes, scales of others."""
    if f.log:
        return float(x * DECADES * np.log(10.0))
    size = f.start or f.scale
    if f.parameter.lower is not None and f.parameter.lower >= 0.0 and size > 0.0:
        return f.theta(size * 10.0 ** (DECADES * x))
    return float(SCALES * x)


def _misfit(stack: JointProblem, theta: Array) -> float:
    """Mean square misfit of the free run from rest, offsets left out of account."""
    point = JointPoint(theta, tuple(start_point(p).states for p in stack.problems))
    total, count = 0.0, 0
    for p, e in zip(stack.problems, stack.evaluate(point, derivatives=False), strict=True):
        rest = e.residual.reshape(len(p.data.names), -1)
        total += float(np.sum((rest - rest.mean(axis=1, keepdims=True)) ** 2))
        count += rest.size
    cost = total / max(count, 1)
    return cost if np.isfinite(cost) else np.inf
