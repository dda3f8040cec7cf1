"""The exact inverse of linear creep, for feed-forward from any state.

Sizes: m units, m states and the last input.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.ops import Expression, Ops

__all__ = ["KelvinVoigtCreepInverse"]


@final
@dataclass(frozen=True, slots=True)
class KelvinVoigtCreepInverse(Operator):
    """The input that makes a wanted output of `KelvinVoigtCreep`.

    The step is linear in the input at its end, so ``x = (y - rest) / direct_gain`` with ``rest``
    the output for a last input of 0. The memory is the one of the forward operator.

    Parameters
    ----------
    forward : KelvinVoigtCreep
        What is inverted.

    Raises
    ------
    BadParameter
        If it is another operator.

    Examples
    --------
    >>> creep = KelvinVoigtCreep(gain=1.0, weights=(0.5,), times=(1.0,))
    >>> y, _ = creep.run([1.0, 3.0, 2.0], step=0.5)
    >>> creep.inverse().run(y, creep.initial_memory(1.0), step=0.5)[0].round(12).tolist()
    [1.0, 3.0, 2.0]
    """

    kind: ClassVar[str] = "kelvin_voigt_creep_inverse"

    forward: KelvinVoigtCreep

    def __post_init__(self) -> None:
        """Check what is inverted."""
        if not isinstance(self.forward, KelvinVoigtCreep):
            raise BadParameter(
                f"forward must be a KelvinVoigtCreep, not {type(self.forward).__name__}"
            )

    @property
    def timed(self) -> bool:
        """Always."""
        return True

    @property
    def n_memory(self) -> int:
        """Memory of the forward operator."""
        return self.forward.n_memory

    @property
    def linear_slope(self) -> Expression:
        """Slope of a jump, 1/w_0."""
        return 1.0 / self.forward.gain

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        units = tuple(0.0 * x0 for _ in self.forward.times) if states is None else states[1:]
        return ((x0 - self.forward._sum(0.0, units)) / self.forward.gain, *units)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        rest = self.forward._value(ops, 0.0, memory, step)
        return (x - rest) / self.forward.direct_gain(ops, step)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return self.forward._advance(ops, self._value(ops, x, memory, step), memory, step)

    def inverse(self) -> KelvinVoigtCreep:
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
