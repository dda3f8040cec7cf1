"""Two operators whose memories stand one behind the other.

Sizes: the memory is the one of the first operator followed by the one of the second.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.ops import Expression, Ops


def require_operators(**parts: object) -> None:
    """Check that every part is an operator.

    Raises
    ------
    BadParameter
        With the name of the first part that is none.

    Examples
    --------
    >>> require_operators()
    """
    for name, part in parts.items():
        if not isinstance(part, Operator):
            raise BadParameter(f"{name} must be an operator, not {type(part).__name__}")


class Pair(Operator, ABC):
    """An operator made of two."""

    __slots__ = ()

    @property
    @abstractmethod
    def _parts(self) -> tuple[Operator, Operator]:
        """The two, in the order of their memories."""

    @property
    def timed(self) -> bool:
        """Whether one of the two is."""
        return any(part.timed for part in self._parts)

    @property
    def n_memory(self) -> int:
        """Memory of both."""
        return sum(part.n_memory for part in self._parts)

    def _split(self, memory: Memory) -> tuple[Memory, Memory]:
        n = self._parts[0].n_memory
        return memory[:n], memory[n:]


@dataclass(frozen=True, slots=True)
class FirstAndSecond(Pair, ABC):
    """Any two operators, of which each is a parameter."""

    first: Operator
    second: Operator

    def __post_init__(self) -> None:
        """Check the parts."""
        require_operators(first=self.first, second=self.second)

    @property
    def _parts(self) -> tuple[Operator, Operator]:
        return self.first, self.second


class SideBySide(Pair, ABC):
    """The sum of two operators that see the same input."""

    __slots__ = ()

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        first, second = self._parts
        one, two = (None, None) if states is None else self._split(states)
        return (
            *first.initial_memory(x0, one, ops=ops),
            *second.initial_memory(x0, two, ops=ops),
        )

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        first, second = self._parts
        one, two = self._split(memory)
        return first.value(ops, x, one, step) + second.value(ops, x, two, step)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        first, second = self._parts
        one, two = self._split(memory)
        return (*first.advance(ops, x, one, step), *second.advance(ops, x, two, step))
