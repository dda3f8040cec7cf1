"""The exact inverse of linear creep, for feed-forward from any state.

Sizes: m units, m states and the last input.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep
from bondgraph.hysteresis.invertible import ForwardInverse
from bondgraph.hysteresis.operator import Memory
from bondgraph.support.ops import Expression, Ops


@final
@dataclass(frozen=True, slots=True)
class KelvinVoigtCreepInverse(ForwardInverse[KelvinVoigtCreep]):
    """The input that makes a wanted output of `KelvinVoigtCreep`.

    The step is linear in the input at its end, so ``x = (y - rest) / direct_gain`` with ``rest``
    the output for a last input of 0.

    Examples
    --------
    >>> creep = KelvinVoigtCreep(gain=1.0, weights=(0.5,), times=(1.0,))
    >>> y, _ = creep.run([1.0, 3.0, 2.0], step=0.5)
    >>> creep.inverse().run(y, creep.initial_memory(1.0), step=0.5)[0].round(12).tolist()
    [1.0, 3.0, 2.0]
    """

    kind: ClassVar[str] = "kelvin_voigt_creep_inverse"

    inverts = KelvinVoigtCreep

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        units = tuple(0.0 * x0 for _ in self.forward.times) if states is None else states[1:]
        return ((x0 - self.forward._sum(0.0, units)) / self.forward.gain, *units)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        rest = self.forward._value(ops, 0.0, memory, step)
        return (x - rest) / self.forward.direct_gain(ops, step)
