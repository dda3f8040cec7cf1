"""One-sided dead zones and their weighted sum: a bent line without memory.

Sizes: m + 1 operators, one of them with threshold 0; n_- below and n_+ above it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, final

from bondgraph.hysteresis.checks import (
    all_numbers,
    is_number,
    numbers,
    parameters,
    same_length,
    strictly_increasing,
)
from bondgraph.hysteresis.errors import BadParameter, NotInvertible
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.kuhnen import (
    first_bad_slope,
    inverse_thresholds,
    inverse_weights,
    slopes,
)
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


def dead_zone(ops: Ops, y: Expression, d: Expression, side: int) -> Expression:
    """Return the part of ``y`` beyond ``d``, on one side.

    ``max(y - d, 0)`` for d > 0, ``min(y - d, 0)`` for d < 0, ``y`` for d = 0.

    Parameters
    ----------
    ops : Ops
        Back end of the values.
    y : expression
        Input, scalar or array, any unit.
    d : expression
        Threshold, unit of ``y``.
    side : int
        Sign of ``d``: 1, -1 or 0. Explicit because an expression does not tell its sign.

    Returns
    -------
    expression
        Shape and unit of ``y``.

    References
    ----------
    kuhnen2003, ang2007

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(dead_zone(NUMPY, -3.0, -1.0, -1))
    -2.0
    """
    if side > 0:
        return ops.maximum(y - d, 0.0)
    if side < 0:
        return ops.minimum(y - d, 0.0)
    return y


@final
@dataclass(frozen=True, slots=True)
class DeadZones(InvertibleOperator["DeadZones"]):
    """Weighted sum of one-sided dead zones ``z = sum_j w_j S_(d_j)[y]``, with an exact inverse.

    Outward from 0 on each side the slope is the partial sum of the weights, and the inverse the
    recursion of the plays.

    Parameters
    ----------
    thresholds : sequence
        d_j, shape (m + 1,), strictly increasing, one of them the number 0; unit of the input.
    weights : sequence
        w_j, shape (m + 1,), any sign; output per input.

    Raises
    ------
    BadParameter
        If the lengths differ, no threshold or more than one is 0, or one is out of order or not
        finite; names the entry.

    References
    ----------
    kuhnen2003, ang2007

    Examples
    --------
    >>> DeadZones((0.0, 1.0), (2.0, -1.0)).run([-1.0, 1.0, 3.0])[0].tolist()
    [-2.0, 2.0, 4.0]
    """

    kind: ClassVar[str] = "dead_zone"

    thresholds: tuple[Expression, ...]
    weights: tuple[Expression, ...]

    def __post_init__(self) -> None:
        """Check and store the parameters as tuples."""
        thresholds = parameters("thresholds", self.thresholds)
        weights = parameters("weights", self.weights)
        same_length("thresholds", thresholds, "weights", weights)
        strictly_increasing("thresholds", thresholds)
        zeros = [i for i, d in enumerate(thresholds) if is_number(d) and d == 0.0]
        if len(zeros) != 1:
            raise BadParameter(
                f"thresholds must hold the number 0 once, not {len(zeros)} times: it carries the "
                "linear part"
            )
        # With expressions next to 0 the order above is not checked against 0, so numbers are here.
        for i, d in enumerate(thresholds):
            if is_number(d) and (d > 0.0) != (i > zeros[0]):
                raise BadParameter(f"thresholds[{i}] = {d} is on the wrong side of the 0 entry")
        object.__setattr__(self, "thresholds", thresholds)
        object.__setattr__(self, "weights", weights)

    @property
    def n_memory(self) -> int:
        """No memory: 0."""
        return 0

    @property
    def zero_index(self) -> int:
        """Index of the entry with threshold 0."""
        return next(i for i, d in enumerate(self.thresholds) if is_number(d) and d == 0.0)

    @property
    def linear_slope(self) -> Expression:
        """Slope around 0; output per input."""
        return self.weights[self.zero_index]

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        return ()

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        zero = self.zero_index
        output = self.weights[zero] * x
        for j, (d, w) in enumerate(zip(self.thresholds, self.weights, strict=True)):
            if j != zero:
                output = output + w * dead_zone(ops, x, d, j - zero)
        return output

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return ()

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        numbers("thresholds", self.thresholds)
        numbers("weights", self.weights)
        output: FloatArray = self._value(NUMPY, x, (), step)
        return output, ()

    @property
    def passive_port(self) -> Literal["input", "output"] | None:
        """``"output"`` if no slope is negative: a spring with a bent characteristic."""
        if not all_numbers(self.weights):
            return None
        zero = self.zero_index
        sides = (slopes(self.weights[zero:]), slopes(self.weights[zero::-1]))
        return "output" if all(slope >= 0.0 for side in sides for slope in side) else None

    def _energy(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, Expression] | None:
        zero = self.zero_index
        stored = 0.5 * self.weights[zero] * x * x
        for j, (d, w) in enumerate(zip(self.thresholds, self.weights, strict=True)):
            if j != zero:
                beyond = dead_zone(ops, x, d, j - zero)
                stored = stored + 0.5 * w * beyond * beyond
        return stored, 0.0

    def check_invertible(self) -> None:
        """Every slope outward from 0 must be positive; the right side is looked at first."""
        zero = self.zero_index
        sides = ((self.weights[zero:], 1), (self.weights[zero::-1], -1))
        for weights, direction in sides:
            bad = first_bad_slope(weights)
            if bad is not None:
                j = zero + direction * bad
                raise NotInvertible(
                    f"no inverse: the slope beyond thresholds[{j}] = {self.thresholds[j]} is "
                    f"{slopes(weights)[bad]:.6g}, not positive; make weights[{j}] = "
                    f"{self.weights[j]:.6g} larger or drop it",
                    j,
                )

    def _inverse(self, ops: Ops) -> DeadZones:
        zero = self.zero_index
        right = _side(self.thresholds[zero:], self.weights[zero:])
        left = _side(self.thresholds[zero::-1], self.weights[zero::-1])
        thresholds = (*left[0][:0:-1], *right[0])
        weights = (*left[1][:0:-1], *right[1])
        return DeadZones(thresholds, weights)


def _side(
    thresholds: Sequence[Expression], weights: Sequence[Expression]
) -> tuple[tuple[Expression, ...], tuple[Expression, ...]]:
    """Return inverse thresholds and weights of one side, from 0 outward."""
    return inverse_thresholds(thresholds, weights), inverse_weights(weights)
