"""Inverses of plays with widths that depend on the rate: one always exact, one fast.

Sizes: n plays with a width, N samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.errors import NotInvertible
from bondgraph.hysteresis.invertible import ForwardInverse, OfForward
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.kuhnen import (
    first_bad_slope,
    inverse_thresholds,
    inverse_weights,
    slopes,
)
from bondgraph.hysteresis.plays.play import play, reachable_plays
from bondgraph.hysteresis.rate.rate import measured_rate
from bondgraph.hysteresis.rate.rate_dependent import RateDependentPrandtlIshlinskii
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
        total = weights[0] * x
        for w, r, p in plays:
            total = total + w * play(ops, x, r, p)
        return total

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


@final
@dataclass(frozen=True, slots=True)
class RateDependentInverse(ForwardInverse[RateDependentPrandtlIshlinskii]):
    """The input that makes a wanted output of `RateDependentPrandtlIshlinskii`.

    Exact to rounding for any widths, because each step is solved with the widths known in it
    (`solve_plays`); errors of earlier steps die out if the forward operator's ``error_gain`` is
    below 1.

    Examples
    --------
    >>> forward = RateDependentPrandtlIshlinskii((0, 1), (0, 0.5), (1, 1))
    >>> y, _ = forward.run([0.0, 1.0, 4.0], step=1.0)
    >>> forward.inverse().run(y, step=1.0)[0].tolist()
    [0.0, 1.0, 4.0]
    """

    kind: ClassVar[str] = "rate_dependent_inverse"

    inverts = RateDependentPrandtlIshlinskii

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        widths = self.forward.widths(ops, memory[1])
        return solve_plays(ops, x, self.forward.weights, widths, memory[2:])


@final
@dataclass(frozen=True, slots=True)
class RateDependentClosedFormInverse(OfForward[RateDependentPrandtlIshlinskii]):
    """Fast inverse ``x = w'_0 y + sum_i w'_i play_(r'_i)[y]``, ``r'_i = sum_j w_j (r_i - r_j)``.

    The recursion of Kuhnen with widths that change. It is exact if no gap r_(i+1) - r_i, i >= 1,
    shrinks in time (`closed_form_check`); otherwise the inner plays are dragged in another order
    than those of the forward operator, and the input is wrong by a percent of its range or more.

    The memory is the last x, its rate and the states of the inverse plays, see
    `RateDependentPrandtlIshlinskii.closed_form_memory`.

    Raises
    ------
    NotInvertible
        With the index of the first slope w_0 + ... + w_i that is not positive.

    References
    ----------
    aljanaideh2013, kuhnen2003

    Examples
    --------
    >>> forward = RateDependentPrandtlIshlinskii((0, 1), (0, 0.5), (1, 1))
    >>> y, _ = forward.run([0.0, 1.0, 4.0], step=1.0)
    >>> forward.closed_form_inverse().run(y, step=1.0)[0].tolist()
    [0.0, 1.0, 4.0]
    """

    kind: ClassVar[str] = "rate_dependent_closed_form_inverse"

    inverts = RateDependentPrandtlIshlinskii

    def __post_init__(self) -> None:
        """Check what is inverted."""
        OfForward.__post_init__(self)
        weights = self.forward.weights
        bad = first_bad_slope(weights)
        if bad is not None:
            raise NotInvertible(
                f"no inverse: with weights[{bad}] = {weights[bad]:.6g} the slope S_{bad} = w_0 + "
                f"... + w_{bad} = {slopes(weights)[bad]:.6g} is not positive; raise that weight",
                bad,
            )

    def _widths(self, ops: Ops, rate: Expression) -> tuple[Expression, ...]:
        return inverse_thresholds((0.0, *self.forward.widths(ops, rate)), self.forward.weights)[1:]

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        if states is not None:
            return states
        at_rest = self._widths(ops, 0.0)
        plays = reachable_plays(ops, x0, at_rest, tuple(0.0 for _ in at_rest))
        x = self._sum(x0, plays)
        return (x, 0.0 * x, *plays)

    def _sum(self, y: Expression, plays: Sequence[Expression]) -> Expression:
        first, *others = inverse_weights(self.forward.weights)
        x = first * y
        for w, p in zip(others, plays, strict=True):
            x = x + w * p
        return x

    def _moved(self, ops: Ops, y: Expression, memory: Memory) -> tuple[Expression, ...]:
        plays = zip(self._widths(ops, memory[1]), memory[2:], strict=True)
        return tuple(play(ops, y, r, p) for r, p in plays)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return self._sum(x, self._moved(ops, x, memory))

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        plays = self._moved(ops, x, memory)
        found = self._sum(x, plays)
        smoothing = self.forward.smoothing
        return (found, measured_rate(ops, found, memory[0], memory[1], step, smoothing), *plays)
