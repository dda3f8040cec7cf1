"""One operator behind the other, and the inverse of any operator that has one.

Sizes: the memory is the one of the first operator followed by the one of the second.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar, cast, final

from bondgraph.hysteresis.composed.pair import FirstAndSecond, Pair
from bondgraph.hysteresis.errors import NotInvertible
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops

Other = TypeVar("Other", bound=Operator, covariant=True)


def inverse_of(ops: Ops, operator: Operator) -> Operator:
    """Return the exact inverse of an operator that has one.

    Parameters
    ----------
    ops : Ops
        Back end of symbolic parameters.
    operator : Operator
        With a method ``inverse``.

    Returns
    -------
    Operator
        Pair it with `inverse_memory_of`.

    Raises
    ------
    NotInvertible
        If the kind has no exact inverse (index -1), or these parameters have none.

    Examples
    --------
    >>> from bondgraph.hysteresis.plays.dead_zone import DeadZones
    >>> inverse_of(NUMPY, DeadZones((0.0,), (2.0,))).linear_slope
    0.5
    """
    if not isinstance(operator, InvertibleOperator):
        raise NotInvertible(
            f"{operator.kind} has no exact inverse; use numeric_inverse on the whole operator", -1
        )
    return cast(Operator, operator.inverse(ops=ops))


def inverse_memory_of(ops: Ops, operator: Operator, memory: Sequence[Expression]) -> Memory:
    """Return the memory of `inverse_of` that belongs to a memory of the operator.

    An operator without memory has nothing to convert; else see `InvertibleOperator.inverse_memory`.

    Examples
    --------
    >>> from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
    >>> inverse_memory_of(NUMPY, PrandtlIshlinskii((0.0, 1.0), (1.0, 2.0)), (0.5,))
    (1.5,)
    """
    if isinstance(operator, InvertibleOperator):
        return operator.inverse_memory(memory, ops=ops)
    return operator._states(memory)


def _invertible(operator: Operator) -> bool:
    try:
        inverse_of(NUMPY, operator)
    except NotInvertible:
        return False
    return True


class InSeries(Pair, InvertibleOperator[Other], ABC, Generic[Other]):
    """One operator behind the other; the inverse is the two inverses in reversed order."""

    __slots__ = ()

    @property
    def wipes_out(self) -> bool:
        """If both do and the inner signal is known to follow the input monotonically."""
        first, second = self._parts
        monotone = second.n_memory == 0 or _invertible(first)
        return monotone and first.wipes_out and second.wipes_out

    @property
    def congruent(self) -> bool:
        """Known only of a bent input, or of an operator behind which nothing bends.

        A second stage that bends reshapes a loop according to its height.
        """
        if self.timed:
            return False
        first, second = self._parts
        if first.n_memory == 0:
            return second.congruent and (second.n_memory == 0 or _invertible(first))
        straight = getattr(second, "thresholds", None)
        return straight is not None and len(straight) == 1 and first.congruent

    @property
    def linear_slope(self) -> Expression:
        """Product of the two slopes."""
        first, second = self._parts
        return first.linear_slope * second.linear_slope

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        first, second = self._parts
        one, two = (None, None) if states is None else self._split(states)
        before = first.initial_memory(x0, one, ops=ops)
        inner = first.value(ops, x0, before)
        return (*before, *second.initial_memory(inner, two, ops=ops))

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        (first, second), (one, two) = self._parts, self._split(memory)
        return second.value(ops, first.value(ops, x, one, step), two, step)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        (first, second), (one, two) = self._parts, self._split(memory)
        if two:
            two = second.advance(ops, first.value(ops, x, one, step), two, step)
        return (*first.advance(ops, x, one, step), *two)

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        (first, second), (one, two) = self._parts, self._split(memory)
        if one and two:  # else rounding in the inner record would reach the memory behind it
            return Operator._record(self, x, memory, step)
        inner, one = first._record(x, one, step)
        output, two = second._record(inner, two, step)
        return output, (*one, *two)

    def _inverse_memory(self, ops: Ops, memory: Memory) -> Memory:
        (first, second), (one, two) = self._parts, self._split(memory)
        return (*inverse_memory_of(ops, second, two), *inverse_memory_of(ops, first, one))


@final
@dataclass(frozen=True, slots=True)
class Cascade(FirstAndSecond, InSeries["Cascade"]):
    """One operator behind the other, ``y = second[first[x]]``.

    A second operator with memory assumes that its input moves monotonically within a step. The
    first one must therefore rise, or fall, with its input; otherwise accept a step at each of its
    turning points too. The inverse is the two inverses in reversed order. No energy function is
    offered: the inner signal does no work.

    Parameters
    ----------
    first : Operator
        Sees the input.
    second : Operator
        Sees the output of the first.

    Raises
    ------
    BadParameter
        If one of them is no operator.

    References
    ----------
    kuhnen2003

    Examples
    --------
    >>> from bondgraph.hysteresis.plays.dead_zone import DeadZones
    >>> from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
    >>> plays, zones = PrandtlIshlinskii((0, 1), (1, 1)), DeadZones((0, 2), (1, 0.5))
    >>> model = Cascade(plays, zones)
    >>> model.run([0.0, 3.0])[0].tolist()
    [0.0, 6.5]
    >>> model.inverse().run([0.0, 6.5])[0].tolist()
    [0.0, 3.0]
    """

    kind: ClassVar[str] = "cascade"

    def _inverse(self, ops: Ops) -> Cascade:
        return Cascade(inverse_of(ops, self.second), inverse_of(ops, self.first))
