"""The fast inverse of plays with widths that depend on the rate: exact under a condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.errors import BadParameter, NotInvertible
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.hysteresis.plays.kuhnen import (
    first_bad_slope,
    inverse_thresholds,
    inverse_weights,
    slopes,
)
from bondgraph.hysteresis.plays.play import play, reachable_plays, sum_of_plays
from bondgraph.hysteresis.rate.rate import measured_rate
from bondgraph.hysteresis.rate.rate_dependent import RateDependentPrandtlIshlinskii
from bondgraph.support.ops import Expression, Ops


@final
@dataclass(frozen=True, slots=True)
class RateDependentClosedFormInverse(Operator):
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

    forward: RateDependentPrandtlIshlinskii

    def __post_init__(self) -> None:
        """Check what is inverted."""
        if not isinstance(self.forward, RateDependentPrandtlIshlinskii):
            raise BadParameter(
                f"forward must be a RateDependentPrandtlIshlinskii, not a "
                f"{type(self.forward).__name__}; ask other operators for their inverse()"
            )
        weights = self.forward.weights
        bad = first_bad_slope(weights)
        if bad is not None:
            raise NotInvertible(
                f"no inverse: with weights[{bad}] = {weights[bad]:.6g} the slope S_{bad} = w_0 + "
                f"... + w_{bad} = {slopes(weights)[bad]:.6g} is not positive; raise that weight",
                bad,
            )

    @property
    def timed(self) -> bool:
        """As the forward operator."""
        return self.forward.timed

    @property
    def n_memory(self) -> int:
        """As many states as the forward operator has."""
        return self.forward.n_memory

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal, one over that of the forward operator."""
        return 1.0 / self.forward.linear_slope

    def _widths(self, ops: Ops, rate: Expression) -> tuple[Expression, ...]:
        return inverse_thresholds((0.0, *self.forward.widths(ops, rate)), self.forward.weights)[1:]

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        if states is not None:
            return states
        at_rest = self._widths(ops, 0.0)
        plays = reachable_plays(ops, x0, at_rest, tuple(0.0 for _ in at_rest))
        x = self._value(ops, x0, (x0, 0.0, *plays), 0.0)
        return (x, 0.0 * x, *plays)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        first, *others = inverse_weights(self.forward.weights)
        return first * x + sum_of_plays(ops, x, self._widths(ops, memory[1]), others, memory[2:])

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        last, rate, *states = memory
        found = self._value(ops, x, memory, step)
        plays = zip(self._widths(ops, rate), states, strict=True)
        rate = measured_rate(ops, found, last, rate, step, self.forward.smoothing)
        return (found, rate, *(play(ops, x, r, p) for r, p in plays))
