"""The Prandtl-Ishlinskii operator: a weighted sum of plays, with an exact inverse.

Sizes: n + 1 operators, number 0 being the identity (threshold 0), n memory states, N samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, final

import numpy as np

from bondgraph.hysteresis.checks import (
    all_numbers,
    from_zero,
    numbers,
    parameters,
    same_length,
    strictly_increasing,
)
from bondgraph.hysteresis.errors import NotInvertible
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.hysteresis.linear import LinearInWeights
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.kuhnen import (
    first_bad_slope,
    inverse_states,
    inverse_thresholds,
    inverse_weights,
    slopes,
)
from bondgraph.hysteresis.plays.play import sum_of_plays, weighted_plays
from bondgraph.hysteresis.plays.swing import swing_record, worth_swinging
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


@final
@dataclass(frozen=True, slots=True)
class PrandtlIshlinskii(LinearInWeights, InvertibleOperator["PrandtlIshlinskii"]):
    """Weighted sum of plays ``y = w_0 x + sum_(i=1..n) w_i play_(r_i)[x]``.

    Thresholds and weights may be expressions (CasADi or SymPy); what can only be checked on
    numbers is then taken on trust.

    With the slopes ``S_i = w_0 + ... + w_i`` the inverse has ``w'_0 = 1/w_0``,
    ``w'_i = -w_i/(S_i S_(i-1))``, ``r'_i = sum_(j<=i) w_j (r_i - r_j)`` and the memory
    ``y'_i = S_i y_i + sum_(j>i) w_j y_j``.

    Parameters
    ----------
    thresholds : sequence
        Half widths r_i, shape (n + 1,), the first one 0, strictly increasing; unit of the input.
    weights : sequence
        w_i, shape (n + 1,), any sign; output per input.

    Raises
    ------
    BadParameter
        If the lengths differ, the first threshold is not 0, or a threshold is negative, out of
        order or not finite; names the entry.

    References
    ----------
    krejci2001, kuhnen2003

    Examples
    --------
    >>> operator = PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5))
    >>> operator.run([0.0, 2.0, 0.0])[0].tolist()
    [0.0, 2.5, 0.5]
    """

    kind: ClassVar[str] = "prandtl_ishlinskii"

    thresholds: tuple[Expression, ...]
    weights: tuple[Expression, ...]

    def __post_init__(self) -> None:
        """Check and store the parameters as tuples."""
        thresholds = parameters("thresholds", self.thresholds)
        weights = parameters("weights", self.weights)
        same_length("thresholds", thresholds, "weights", weights)
        from_zero("thresholds", thresholds, "linear")
        strictly_increasing("thresholds", thresholds)
        object.__setattr__(self, "thresholds", thresholds)
        object.__setattr__(self, "weights", weights)

    @property
    def n_memory(self) -> int:
        """Number of plays with a width, n."""
        return len(self.thresholds) - 1

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal and of the virgin curve at first, w_0; output per input."""
        return self.weights[0]

    @property
    def slope_full(self) -> Expression:
        """Slope when every play moves, sum of w_i; output per input."""
        return slopes(self.weights)[-1]

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        plays = sum_of_plays(ops, x, self._half_widths, self.weights[1:], memory)
        return self.weights[0] * x + plays

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        r = np.array(numbers("thresholds", self.thresholds))[1:]
        w = np.array(numbers("weights", self.weights))
        states = np.array(memory)
        if not r.size:
            return w[0] * x, ()
        if worth_swinging(x, r, states):
            before = float(np.clip(x[0], states[0] - r[0], states[0] + r[0]))
            start = float(w[0] * before + w[1:] @ states)
            output, states = swing_record(x, r, np.cumsum(w), states, before, start)
        else:
            output, states = weighted_plays(x, r, w[1:], states)
            output += w[0] * x
        return output, tuple(states.tolist())

    @property
    def passive_port(self) -> Literal["input", "output"] | None:
        """``"input"`` if no weight is negative, ``"output"`` if all plays are subtracted.

        In the second case the operator is a spring with stops of stiffness -w_i, and the slope
        with every play moving must not be negative.
        """
        if not all_numbers(self.weights):
            return None
        first, *others = self.weights
        if first >= 0.0 and all(w >= 0.0 for w in others):
            return "input"
        stiff = first >= 0.0 and self.slope_full >= -1e-12 * first
        return "output" if stiff and all(w <= 0.0 for w in others) else None

    def _energy(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, Expression] | None:
        stored = 0.5 * self.weights[0] * x * x
        lost: Expression = 0.0
        states = self._advance(ops, x, memory, 0.0)
        plays = zip(self.thresholds[1:], self.weights[1:], states, memory, strict=True)
        for r, w, after, before in plays:
            stored = stored + 0.5 * w * after * after
            lost = lost + w * r * ops.absolute(after - before)
        if self.passive_port == "output":
            return x * self._value(ops, x, memory, 0.0) - stored, -lost
        return stored, lost

    @property
    def _half_widths(self) -> Sequence[Expression]:
        return self.thresholds[1:]

    def _columns(self, plays: FloatArray) -> FloatArray:
        return plays

    def check_invertible(self) -> None:
        """Every slope S_i = w_0 + ... + w_i must be positive."""
        bad = first_bad_slope(self.weights)
        if bad is not None:
            raise NotInvertible(
                f"no inverse: with weights[{bad}] = {self.weights[bad]:.6g} the slope "
                f"S_{bad} = w_0 + ... + w_{bad} = {slopes(self.weights)[bad]:.6g} is not positive; "
                "fit the weights under 'every partial sum positive', or drop the thresholds from "
                f"r_{bad} = {self.thresholds[bad]} on",
                bad,
            )

    def _inverse(self, ops: Ops) -> PrandtlIshlinskii:
        return PrandtlIshlinskii(
            inverse_thresholds(self.thresholds, self.weights), inverse_weights(self.weights)
        )

    def _inverse_memory(self, ops: Ops, memory: Memory) -> Memory:
        return inverse_states(self.weights, memory)

    def loop_loss(self, amplitude: Expression, *, ops: Ops = NUMPY) -> Expression:
        """Return the area of a closed loop between two turning points.

        The cyclic integral of x dy, ``4 sum w_i r_i max(A - r_i, 0)``. It is the energy lost per
        cycle when x is the effort and y the displacement.

        Parameters
        ----------
        amplitude : expression
            Half of the peak-to-peak input, A >= 0, unit of the input.
        ops : Ops, optional
            Back end of the amplitude and of symbolic parameters.

        Returns
        -------
        expression
            Unit of the input times unit of the output.

        References
        ----------
        krejci2001
        """
        area: Expression = 0.0
        for r, w in zip(self.thresholds, self.weights, strict=True):
            area = area + 4.0 * w * r * ops.maximum(amplitude - r, 0.0)
        return area
