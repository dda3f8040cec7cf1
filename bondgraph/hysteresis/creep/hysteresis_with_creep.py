"""Hysteresis and creep side by side, with an inverse that needs no equation to be solved.

Sizes: the memory is the one of the hysteresis, n states, followed by the one of the creep.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.composed.cascade import inverse_memory_of, inverse_of, require_operators
from bondgraph.hysteresis.creep.log_creep import LogCreep
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.ops import NUMPY, Expression, Ops

__all__ = ["HysteresisWithCreep", "HysteresisWithCreepInverse"]


@final
@dataclass(frozen=True, slots=True)
class HysteresisWithCreep(Operator):
    """``y = H[x] + K[x]`` with creep K that does not see the present input.

    Followed by dead zones in a `Cascade` it is the full model of a piezo actuator with hysteresis,
    creep and saturation.

    Parameters
    ----------
    hysteresis : Operator
        H; the inverse needs one with ``inverse``.
    creep : LogCreep
        K, output in the unit of H.

    Raises
    ------
    BadParameter
        If a part is of another kind.

    References
    ----------
    krejci2001, kuhnen2003

    Examples
    --------
    >>> from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
    >>> hysteresis = PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5))
    >>> model = HysteresisWithCreep(hysteresis, LogCreep((1.0,), (0.0,), (0.5,)))
    >>> y, _ = model.run([2.0, 2.0, 1.0], step=1.0)
    >>> y.round(3).tolist()
    [3.132, 3.365, 2.45]
    >>> model.inverse().run(y, model.initial_memory(2.0), step=1.0)[0].round(12).tolist()
    [2.0, 2.0, 1.0]
    """

    kind: ClassVar[str] = "hysteresis_with_creep"

    hysteresis: Operator
    creep: LogCreep

    def __post_init__(self) -> None:
        """Check the parts."""
        require_operators(hysteresis=self.hysteresis)
        if not isinstance(self.creep, LogCreep):
            raise BadParameter(
                f"creep must be a LogCreep, which does not see the present input, not "
                f"{type(self.creep).__name__}; add others with Parallel"
            )

    @property
    def timed(self) -> bool:
        """Always, through the creep."""
        return True

    @property
    def n_memory(self) -> int:
        """Memory of the hysteresis and of the creep."""
        return self.hysteresis.n_memory + self.creep.n_memory

    @property
    def linear_slope(self) -> Expression:
        """Slope of the hysteresis; the creep adds nothing within a step."""
        return self.hysteresis.linear_slope

    def _split(self, memory: Memory) -> tuple[Memory, Memory]:
        n = self.hysteresis.n_memory
        return memory[:n], memory[n:]

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        first, second = (None, None) if states is None else self._split(states)
        return (
            *self.hysteresis.initial_memory(x0, first, ops=ops),
            *self.creep.initial_memory(x0, second, ops=ops),
        )

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        first, second = self._split(memory)
        return self.hysteresis.value(ops, x, first, step) + self.creep.value(ops, x, second, step)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        first, second = self._split(memory)
        return (
            *self.hysteresis.advance(ops, x, first, step),
            *self.creep.advance(ops, x, second, step),
        )

    def inverse(self, *, ops: Ops = NUMPY) -> HysteresisWithCreepInverse:
        """Return the exact inverse; pair it with `inverse_memory`.

        Parameters
        ----------
        ops : Ops, optional
            Back end of symbolic parameters.

        Returns
        -------
        HysteresisWithCreepInverse
            Maps the output back to the input.

        Raises
        ------
        NotInvertible
            If the hysteresis has no inverse.

        References
        ----------
        krejci2001
        """
        inverse_of(ops, self.hysteresis)
        return HysteresisWithCreepInverse(self)

    def inverse_memory(self, memory: Sequence[Expression]) -> Memory:
        """Return the memory of the inverse: the same.

        Raises
        ------
        BadMemory
            If the memory is not one of this operator.
        """
        return self._states(memory)


@final
@dataclass(frozen=True, slots=True)
class HysteresisWithCreepInverse(Operator):
    """The input that makes a wanted output of `HysteresisWithCreep`, ``x = H^-1[y - K[x]]``.

    K[x] at a sample is made by the inputs before it, so it is known before x is. The memory is the
    one of the forward operator, which is advanced with the x found; one given to
    ``initial_memory`` keeps its own last input.

    Parameters
    ----------
    forward : HysteresisWithCreep
        What is inverted.

    Raises
    ------
    BadParameter
        If it is another operator.

    References
    ----------
    krejci2001

    Examples
    --------
    >>> from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
    >>> model = HysteresisWithCreep(PrandtlIshlinskii((0.0,), (2.0,)), LogCreep((1.0,), (0,), (1,)))
    >>> HysteresisWithCreepInverse(model).run([2.0, 2.0], step=1.0)[0].round(3).tolist()
    [0.684, 0.668]
    """

    kind: ClassVar[str] = "hysteresis_with_creep_inverse"

    forward: HysteresisWithCreep

    def __post_init__(self) -> None:
        """Check what is inverted."""
        if not isinstance(self.forward, HysteresisWithCreep):
            raise BadParameter(
                f"forward must be a HysteresisWithCreep, not {type(self.forward).__name__}"
            )

    @property
    def timed(self) -> bool:
        """Always, through the creep."""
        return True

    @property
    def n_memory(self) -> int:
        """Memory of the forward operator."""
        return self.forward.n_memory

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal, one over the slope of the hysteresis."""
        return 1.0 / self.forward.linear_slope

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        hysteresis = self.forward.hysteresis
        if states is None:
            inverse = inverse_of(ops, hysteresis)
            x = inverse.value(ops, x0, inverse.initial_memory(x0, ops=ops))
            return self.forward.initial_memory(x, ops=ops)
        return self.forward.initial_memory(states[hysteresis.n_memory], states, ops=ops)

    def _solved(self, ops: Ops, y: Expression, memory: Memory, step: Expression) -> Expression:
        hysteresis = self.forward.hysteresis
        inverse = inverse_of(ops, hysteresis)
        return inverse.value(ops, y, inverse_memory_of(ops, hysteresis, memory), step)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        first, second = self.forward._split(memory)
        return self._solved(ops, x - self.forward.creep.value(ops, x, second, step), first, step)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return self.forward.advance(ops, self._value(ops, x, memory, step), memory, step)

    def inverse(self) -> HysteresisWithCreep:
        """Return the forward operator."""
        return self.forward

    def inverse_memory(self, memory: Sequence[Expression]) -> Memory:
        """Return the memory of the forward operator: the same.

        Raises
        ------
        BadMemory
            If the memory is not one of this operator.
        """
        return self._states(memory)
