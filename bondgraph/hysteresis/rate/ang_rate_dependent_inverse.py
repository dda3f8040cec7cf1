"""The exact inverse of plays whose slopes change with the rate.

Sizes: n plays with a width, N samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from bondgraph.hysteresis.checks import is_number, numbers
from bondgraph.hysteresis.invertible import ForwardInverse
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.rate.ang_rate_dependent import AngRateDependent
from bondgraph.hysteresis.rate.rate import rate_record
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


@final
@dataclass(frozen=True, slots=True)
class AngRateDependentInverse(ForwardInverse[AngRateDependent]):
    """The input that makes a wanted output of `AngRateDependent`.

    Only the weights change with the rate, so the plays stay nested and the recursion of Kuhnen,
    applied anew in each step, is exact. The x found is fed back through the rate: where the slopes
    depend strongly on the rate, short steps need ``smoothing`` or errors grow.

    Raises
    ------
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

    inverts = AngRateDependent

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        if ops is NUMPY and is_number(memory[1]):
            self.forward.check_invertible(memory[1])
        plays = self.forward.at_rate(ops, memory[1])
        return plays.inverse().value(ops, x, plays.inverse_memory(memory[2:]))

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        # The compiled record needs CasADi, which is slow to import.
        from bondgraph.hysteresis.compiled import compiled_record

        found, after = compiled_record(self, x, memory, step)
        (smoothing,) = numbers("smoothing", (self.forward.smoothing,))
        last, before = float(memory[0]), float(memory[1])
        rates = np.append(before, rate_record(found, last, before, step, smoothing)[:-1])
        self.forward.check_invertible(float(np.max(np.abs(rates))))
        return found, after
