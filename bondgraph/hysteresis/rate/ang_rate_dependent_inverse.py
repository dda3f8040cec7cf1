"""The exact inverse of plays whose slopes change with the rate.

Sizes: n plays with a width, N samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from bondgraph.hysteresis.checks import is_number, numbers
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.hysteresis.rate.ang_rate_dependent import AngRateDependent
from bondgraph.hysteresis.rate.rate import rate_record
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops

__all__ = ["AngRateDependentInverse"]


@final
@dataclass(frozen=True, slots=True)
class AngRateDependentInverse(Operator):
    """The input that makes a wanted output of `AngRateDependent`.

    Only the weights change with the rate, so the plays stay nested and the recursion of Kuhnen,
    applied anew in each step, is exact. The x found is fed back through the rate: where the slopes
    depend strongly on the rate, short steps need ``smoothing`` or errors grow. The memory is the
    one of the forward operator; one given to ``initial_memory`` keeps its own last input.

    Parameters
    ----------
    forward : AngRateDependent
        What is inverted.

    Raises
    ------
    BadParameter
        If it is another operator.
    NotInvertible
        From ``run``, if the input found is faster than `AngRateDependent.rate_limit`.

    References
    ----------
    ang2007, kuhnen2003

    Examples
    --------
    >>> forward = AngRateDependent((0.0, 1.0), (1.0, 1.0), (0.0, -0.25))
    >>> forward.inverse().run([0.0, 3.0, 5.5], step=1.0)[0].tolist()
    [0.0, 2.0, 4.0]
    """

    kind: ClassVar[str] = "ang_rate_dependent_inverse"

    forward: AngRateDependent

    def __post_init__(self) -> None:
        """Check what is inverted."""
        if not isinstance(self.forward, AngRateDependent):
            raise BadParameter(
                f"forward must be an AngRateDependent, not {type(self.forward).__name__}"
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
        """Slope right after a reversal at rest, 1/w_0."""
        return 1.0 / self.forward.weights[0]

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        if states is not None:
            return self.forward.initial_memory(states[0], states, ops=ops)
        rest = self.forward.initial_memory(0.0, ops=ops)
        return self.forward.initial_memory(self._value(ops, x0, rest, 0.0), ops=ops)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        if ops is NUMPY and is_number(memory[1]):
            self.forward.check_invertible(memory[1])
        plays = self.forward.at_rate(ops, memory[1])
        return plays.inverse().value(ops, x, plays.inverse_memory(memory[2:]))

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return self.forward.advance(ops, self._value(ops, x, memory, step), memory, step)

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        # The compiled record needs CasADi, which is slow to import.
        from bondgraph.hysteresis.compiled import compiled_record

        found, after = compiled_record(self, x, memory, step)
        (smoothing,) = numbers("smoothing", (self.forward.smoothing,))
        last, before = float(memory[0]), float(memory[1])
        rates = np.append(before, rate_record(found, last, before, step, smoothing)[:-1])
        self.forward.check_invertible(float(np.max(np.abs(rates))))
        return found, after

    def inverse(self) -> AngRateDependent:
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
