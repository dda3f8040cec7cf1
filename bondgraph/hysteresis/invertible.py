"""Operators whose inverse is known in closed form, and inverses that carry the forward memory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.ops import NUMPY, Expression, Ops

__all__ = ["ForwardInverse", "InvertibleOperator", "OfForward"]

Other = TypeVar("Other", bound=Operator, covariant=True)
Forward = TypeVar("Forward", bound=Operator)


class InvertibleOperator(Operator, ABC, Generic[Other]):
    """An operator with an exact inverse; subclasses say how it is made and check that there is one.

    `check_invertible`, `_inverse` and, where the memories differ, `_inverse_memory` are theirs.
    """

    __slots__ = ()

    def check_invertible(self) -> None:
        """Raise if the output does not rise with the input; symbolic parameters pass.

        Raises
        ------
        NotInvertible
            With the index of the first parameter that is to blame.
        """

    @abstractmethod
    def _inverse(self, ops: Ops) -> Other:
        """Return the inverse of checked parameters."""

    def _inverse_memory(self, ops: Ops, memory: Memory) -> Memory:
        """Return the memory of the inverse; the same if it carries the forward memory."""
        return memory

    def inverse(self, *, ops: Ops = NUMPY) -> Other:
        """Return the exact inverse, from output to input; pair it with `inverse_memory`.

        Parameters
        ----------
        ops : Ops, optional
            Back end of symbolic parameters.

        Returns
        -------
        Operator
            Its input has the unit of the output here, and the other way round.

        Raises
        ------
        NotInvertible
            If these parameters have none, see `check_invertible`.

        References
        ----------
        krejci2001, kuhnen2003
        """
        self.check_invertible()
        return self._inverse(ops)

    def inverse_memory(self, memory: Sequence[Expression], *, ops: Ops = NUMPY) -> Memory:
        """Return the memory of the inverse that belongs to a memory of this operator.

        Exact for memories that an input history can produce, which are all that `initial_memory`,
        `advance` and `run` return.

        Parameters
        ----------
        memory : sequence of expression
            Shape (n_memory,), unit of the input.
        ops : Ops, optional
            Back end of the memory and of symbolic parameters.

        Returns
        -------
        tuple of expression
            Shape of the inverse's memory, unit of the output, unless the inverse carries the
            memory of this operator.

        Raises
        ------
        BadMemory
            If the memory is not one of this operator.

        References
        ----------
        kuhnen2003
        """
        return self._inverse_memory(ops, self._states(memory))


@dataclass(frozen=True, slots=True)
class OfForward(Operator, ABC, Generic[Forward]):
    """An operator that undoes a forward operator.

    Parameters
    ----------
    forward : Operator
        What is inverted, of the kind `inverts`.

    Raises
    ------
    BadParameter
        If it is another operator.
    """

    inverts: ClassVar[type[Operator]]

    forward: Forward

    def __post_init__(self) -> None:
        """Check what is inverted."""
        if not isinstance(self.forward, self.inverts):
            raise BadParameter(
                f"forward must be a {self.inverts.__name__}, not {type(self.forward).__name__}: an "
                "inverse belongs to one kind of operator"
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


class ForwardInverse(OfForward[Forward], InvertibleOperator[Forward], ABC, Generic[Forward]):
    """The input that makes a wanted output of a forward operator, whose memory it carries.

    Subclasses solve one step for the input in `_value`; the forward operator is then advanced with
    the input found. A memory given to ``initial_memory`` keeps its own last input, because no
    output tells it.
    """

    __slots__ = ()

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        if states is not None:
            return self.forward.initial_memory(states[0], states, ops=ops)
        rest = self.forward.initial_memory(0.0, ops=ops)
        return self.forward.initial_memory(self._value(ops, x0, rest, 0.0), ops=ops)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return self.forward.advance(ops, self._value(ops, x, memory, step), memory, step)

    def _inverse(self, ops: Ops) -> Forward:
        return self.forward
