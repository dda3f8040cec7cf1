"""Plays whose widths grow with the rate of the input.

Sizes: n plays with a width beside the identity (number 0), N samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, final

from bondgraph.hysteresis.checks import (
    from_zero,
    is_number,
    numbers,
    parameter,
    parameters,
    positive,
    same_length,
    strictly_increasing,
)
from bondgraph.hysteresis.creep.first_order_lag import relaxed_share
from bondgraph.hysteresis.errors import NotInvertible
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.kuhnen import first_bad_slope, inverse_states, slopes
from bondgraph.hysteresis.plays.play import play, sum_of_plays
from bondgraph.hysteresis.rate.rated_plays import RatedPlays
from bondgraph.hysteresis.rate.solve_plays import solve_plays
from bondgraph.support.ops import NUMPY, Expression, Ops

if TYPE_CHECKING:
    from bondgraph.hysteresis.rate.closed_form_inverse import RateDependentClosedFormInverse


@final
@dataclass(frozen=True, slots=True)
class RateDependentPrandtlIshlinskii(RatedPlays):
    """``y = w_0 x + sum_(i=1..n) w_i play_(r_i)[x]`` with ``r_i = a_i + b_i |v|``.

    v is the rate of the input over the last accepted step, so the widths are known before the
    present input is. With the rate inside the step, x - r_i would have the slope 1 - b_i/h in a
    trial input: for steps h shorter than b_i the output would fall with a rising input, and no
    solver could invert it or close a loop around it.

    The inverse is exact to rounding for any widths, because each step is solved with those known in
    it (`solve_plays`). It feeds the input it found back through the rate, and an error grows from
    step to step if `error_gain` exceeds 1. A smoothing of at least the largest rate gain
    prevents that at any step; without smoothing, steps must be longer than the rate gains.

    The memory is the last input, the rate v and the n states of the plays. When v falls the plays
    are dragged by their narrowing slots, even if the input rests. No energy function is offered:
    the work in a step depends on where within it the widths change.

    Parameters
    ----------
    thresholds : sequence
        Half widths at rest a_i, shape (n + 1,), the first one 0, strictly increasing; unit of the
        input.
    rate_gains : sequence
        b_i >= 0, shape (n + 1,), the first one 0; s (unit of the input per rate of the input).
    weights : sequence
        w_i, shape (n + 1,), any sign; output per input.
    smoothing : expression, optional
        Time constant of a first-order lag on the rate, s; 0 for none. A rate from rounded samples
        needs it.

    Raises
    ------
    BadParameter
        If the lengths differ, a first entry is not 0, a threshold or rate gain is negative, or the
        thresholds are out of order; names the entry.

    References
    ----------
    aljanaideh2013

    Examples
    --------
    >>> operator = RateDependentPrandtlIshlinskii((0, 1), (0, 0.5), (1, 1))
    >>> operator.run([0.0, 3.0, 3.0], step=1.0)[0].tolist()
    [0.0, 5.0, 5.0]
    >>> operator.run([0.0, 1.0, 4.0], step=1.0)[0].tolist()
    [0.0, 1.0, 6.5]
    >>> operator.inverse().run([0.0, 1.0, 6.5], step=1.0)[0].tolist()
    [0.0, 1.0, 4.0]
    """

    kind: ClassVar[str] = "rate_dependent_prandtl_ishlinskii"

    thresholds: tuple[Expression, ...]
    rate_gains: tuple[Expression, ...]
    weights: tuple[Expression, ...]
    smoothing: Expression = 0.0

    def __post_init__(self) -> None:
        """Check and store the parameters as tuples."""
        for name in ("thresholds", "rate_gains", "weights"):
            object.__setattr__(self, name, parameters(name, getattr(self, name)))
        object.__setattr__(self, "smoothing", parameter("smoothing", self.smoothing))
        same_length("thresholds", self.thresholds, "weights", self.weights)
        same_length("thresholds", self.thresholds, "rate_gains", self.rate_gains)
        for name, values in (("thresholds", self.thresholds), ("rate_gains", self.rate_gains)):
            from_zero(name, values, "memoryless")
        strictly_increasing("thresholds", self.thresholds)
        positive("smoothing", self.smoothing, or_zero=True)

    def widths(self, ops: Ops, rate: Expression) -> tuple[Expression, ...]:
        """Return ``r_i = a_i + b_i |v|`` of the plays 1..n at a rate v, shape (n,)."""
        speed = ops.absolute(rate)
        gains = zip(self.thresholds[1:], self.rate_gains[1:], strict=True)
        return tuple(a + b * speed for a, b in gains)

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        if states is None:
            return (x0, 0.0 * x0, *(play(ops, x0, a, 0.0) for a in self.thresholds[1:]))
        plays: list[Expression] = []
        near, low, gain = x0, 0.0, 0.0
        pairs = zip(self.thresholds[1:], self.rate_gains[1:], states[2:], strict=True)
        for a, b, state in pairs:
            # Only slots of equal rate gain keep their distance; others may have been any width.
            bounded = is_number(b) and is_number(gain) and b == gain
            plays.append(play(ops, near, a - low, state) if bounded else state)
            near, low, gain = plays[-1], a, b
        return (x0, states[1], *plays)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        plays = sum_of_plays(ops, x, self.widths(ops, memory[1]), self.weights[1:], memory[2:])
        return self.weights[0] * x + plays

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        rate = self._rate(ops, x, memory, step)
        plays = zip(self.widths(ops, memory[1]), memory[2:], strict=True)
        return (x, rate, *(play(ops, x, r, p) for r, p in plays))

    def check_invertible(self) -> None:
        """Require ``w_0`` plus every subset of the other weights to be positive.

        Widths that change may let any of the plays move while the others rest; the worst subset is
        that of the negative weights.
        """
        worst = (self.weights[0], *_negative_parts(self.weights[1:]))
        bad = first_bad_slope(worst)
        if bad is not None:
            raise NotInvertible(
                f"no inverse: w_0 plus the negative weights up to weights[{bad}] = "
                f"{self.weights[bad]:.6g} is {slopes(worst)[bad]:.6g}, not positive, so the output "
                "can fall while the input rises; make that weight less negative or raise w_0",
                bad,
            )

    def error_gain(self, step: float) -> float:
        """Return how much of an error of x an inverse feeds back through the rate.

        ``(g/h) sum w_i b_i / (w_0 + sum w_i)``, g being the share of the lag done in a step h, for
        the worst set of plays that may move together. While they keep moving, an error e follows
        ``e_k = (1 - g + gain) e_(k-1) - gain e_(k-2)`` and dies out if the gain is below 1.

        Parameters
        ----------
        step : float
            Time between samples h, s.

        Returns
        -------
        float
            Below 1 for feed-forward that may run for ever.

        Raises
        ------
        NotInvertible
            If the output can fall while the input rises, see `check_invertible`.
        BadParameter
            If a parameter is symbolic.
        """
        self.check_invertible()
        first, *w = numbers("weights", self.weights)
        b = numbers("rate_gains", self.rate_gains)[1:]
        (smoothing,) = numbers("smoothing", (self.smoothing,))
        ratio, found = -1.0, 0.0
        while found > ratio:  # the best set is the one that pays at the best ratio (Dinkelbach)
            ratio = found
            moving = [(w_i, b_i) for w_i, b_i in zip(w, b, strict=True) if w_i * (b_i - ratio) > 0]
            slope = first + sum(w_i for w_i, _ in moving)
            found = max(ratio, sum(w_i * b_i for w_i, b_i in moving) / slope)
        return ratio * float(relaxed_share(NUMPY, step / max(smoothing, 1e-300))) / step

    def _solved(self, ops: Ops, y: Expression, memory: Memory, step: Expression) -> Expression:
        return solve_plays(ops, y, self.weights, self.widths(ops, memory[1]), memory[2:])

    def closed_form_inverse(self) -> RateDependentClosedFormInverse:
        """Return the inverse by the recursion of the weights; pair it with `closed_form_memory`.

        Its cost is linear in n, that of `inverse` quadratic. It is exact only for motions that pass
        `bondgraph.hysteresis.rate.closed_form_check`.

        Raises
        ------
        NotInvertible
            With the index of the first slope w_0 + ... + w_i that is not positive.

        References
        ----------
        aljanaideh2013
        """
        # the inverse is made of this class, so this module cannot import it at the top
        from bondgraph.hysteresis.rate.closed_form_inverse import RateDependentClosedFormInverse

        return RateDependentClosedFormInverse(self)

    def closed_form_memory(self, memory: Sequence[Expression]) -> Memory:
        """Return the memory of `closed_form_inverse` that belongs to a memory of this operator.

        Parameters
        ----------
        memory : sequence of expression
            Shape (n + 2,).

        Returns
        -------
        tuple of expression
            Last input, rate and the states of the inverse plays, the latter in output units.

        Raises
        ------
        BadMemory
            If the memory is not one of this operator.

        References
        ----------
        kuhnen2003
        """
        last, rate, *plays = self._states(memory)
        return (last, rate, *inverse_states(self.weights, plays))


def _negative_parts(weights: Sequence[Expression]) -> tuple[Expression, ...]:
    return tuple(min(w, 0.0) if is_number(w) else w for w in weights)
