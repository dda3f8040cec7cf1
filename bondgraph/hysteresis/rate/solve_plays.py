"""The input of weighted plays for a wanted output, whatever their widths and states are."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.hysteresis.plays.play import sum_of_plays
from bondgraph.support.ops import Expression, Ops


def solve_plays(
    ops: Ops,
    y: Expression,
    weights: Sequence[Expression],
    widths: Sequence[Expression],
    states: Sequence[Expression],
) -> Expression:
    """Return x with ``w_0 x + sum_i w_i play_(r_i)(x; p_i) = y``, whatever widths and states are.

    The left side is piecewise linear with corners at ``p_i - r_i`` and ``p_i + r_i``. The last
    corner that does not exceed y is found by comparing all of them, and the rest of the way is one
    line: no branch, no iteration, n^2 operations.

    Parameters
    ----------
    ops : Ops
        Back end of the values.
    y : expression
        Wanted output, scalar or array.
    weights : sequence of expression
        Shape (n + 1,); every sum of w_0 and any of the others must be positive.
    widths : sequence of expression
        Half widths r_i >= 0, any order, shape (n,), unit of x.
    states : sequence of expression
        p_i, shape (n,), unit of x.

    Returns
    -------
    expression
        Shape of ``y``.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(solve_plays(NUMPY, 2.5, (1.0, 0.5), (1.0,), (0.0,)))
    2.0
    """
    plays = list(zip(weights[1:], widths, states, strict=True))
    if not plays:
        return y / weights[0]

    def output(x: Expression) -> Expression:
        return weights[0] * x + sum_of_plays(ops, x, widths, weights[1:], states)

    lower, upper = [p - r for _, r, p in plays], [p + r for _, r, p in plays]
    corners = lower + upper
    heights = [output(corner) for corner in corners]
    # both rise together, so the lowest corner belongs to the lowest height
    x_first, y_first = corners[0], heights[0]
    for corner, height in zip(corners, heights, strict=True):
        x_first, y_first = ops.minimum(x_first, corner), ops.minimum(y_first, height)
    x_last, y_last = x_first, y_first
    for corner, height in zip(corners, heights, strict=True):
        passed = height <= y
        x_last = ops.maximum(x_last, ops.where(passed, corner, x_first))
        y_last = ops.maximum(y_last, ops.where(passed, height, y_first))
    slope = weights[0]
    for (w, _, _), low, high in zip(
        plays, heights[: len(plays)], heights[len(plays) :], strict=True
    ):
        slope = slope + ops.where(high <= y, w, ops.where(y < low, w, 0.0))
    return x_last + (y - y_last) / slope
