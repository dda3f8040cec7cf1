"""Operators whose inverse is known in closed form, or found by solving step after step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar, final

from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops

Other = TypeVar("Other", bound=Operator, covariant=True)


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


class SolvedInSteps(InvertibleOperator["Inverse"], ABC):
    """An operator of which every single step can be solved for its input.

    Its inverse carries the memory of the operator itself.
    """

    __slots__ = ()

    kind = "operator that is solved step by step"

    @property
    def _inverse_slope(self) -> Expression:
        """Slope of the inverse right after a reversal; input per output."""
        return 1.0 / self.linear_slope

    @property
    def _inverse_congruent(self) -> bool:
        """Whether minor loops of the inverse between the same outputs have the same shape."""
        return not self.timed

    @abstractmethod
    def _solved(self, ops: Ops, y: Expression, memory: Memory, step: Expression) -> Expression:
        """Return the input that makes the output ``y``, ``step`` seconds after the memory."""

    def _memory_at(self, ops: Ops, y0: Expression, states: Memory | None) -> Memory:
        """Return the memory at the output ``y0``; ``states = None`` asks for the virgin one.

        A memory given keeps its own last input, because no output tells it.
        """
        if states is not None:
            return self.initial_memory(states[0], states, ops=ops)
        rest = self.initial_memory(0.0, ops=ops)
        return self.initial_memory(self._solved(ops, y0, rest, 0.0), ops=ops)

    def _check_solved(self, y: FloatArray, x: FloatArray, memory: Memory, step: float) -> None:
        """Raise if outputs, or the inputs found for them, are beyond what can be inverted.

        Both over a record, shape (N,); `memory` is that before it.
        """

    def _inverse(self, ops: Ops) -> Inverse:
        return Inverse(self)


@final
@dataclass(frozen=True, slots=True)
class Inverse(InvertibleOperator[SolvedInSteps]):
    """The input that makes a wanted output of an operator, whose memory it carries.

    Each step is solved for the input; the operator is then advanced with the input found.

    Parameters
    ----------
    forward : Operator
        What is inverted, one that is solved step by step.

    Raises
    ------
    BadParameter
        If it is another operator.
    NotInvertible
        From ``run``, if the inputs found are beyond what can be inverted.

    Examples
    --------
    >>> from bondgraph.hysteresis import KelvinVoigtCreep
    >>> creep = KelvinVoigtCreep(gain=1.0, weights=(0.5,), times=(1.0,))
    >>> y, _ = creep.run([1.0, 3.0, 2.0], step=0.5)
    >>> Inverse(creep).run(y, creep.initial_memory(1.0), step=0.5)[0].round(12).tolist()
    [1.0, 3.0, 2.0]
    """

    kind: ClassVar[str] = "inverse"

    forward: SolvedInSteps

    def __post_init__(self) -> None:
        """Check what is inverted."""
        if not isinstance(self.forward, SolvedInSteps):
            raise BadParameter(
                f"forward must be an {SolvedInSteps.kind}, not a {type(self.forward).__name__}; "
                "ask other operators for their inverse()"
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
        """Slope right after a reversal; input per output of the forward operator."""
        return self.forward._inverse_slope

    @property
    def congruent(self) -> bool:
        """As the forward operator says."""
        return self.forward._inverse_congruent

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        return self.forward._memory_at(ops, x0, states)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return self.forward._solved(ops, x, memory, step)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return self.forward.advance(ops, self._value(ops, x, memory, step), memory, step)

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        found, after = InvertibleOperator._record(self, x, memory, step)
        self.forward._check_solved(x, found, memory, step)
        return found, after

    def _inverse(self, ops: Ops) -> SolvedInSteps:
        return self.forward
