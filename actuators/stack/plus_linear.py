"""An operator with memory and a linear part beside it, as one law.

A law is a slope plus a deviation, so a linear part of any sign only changes the slope. It is what
is left when a linear spring or capacitor is taken out of an operator that bends before its plays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, final

from bondgraph.hysteresis import AngInverse, MaxwellResistiveCapacitor, PrandtlIshlinskii
from bondgraph.laws import Hysteretic, Law
from bondgraph.support.ops import Ops


@final
@dataclass(frozen=True)
class PlusLinear(Law):
    """An operator plus a linear part, ``H[s] + linear s``, as the whole law of an element.

    Parameters
    ----------
    operator : Operator
    linear : float
        Any sign; output per input.
    """

    operator: AngInverse | PrandtlIshlinskii | MaxwellResistiveCapacitor
    linear: float
    name: ClassVar[str] = "operator_plus_linear"

    @property
    def _plain(self) -> Hysteretic:
        return Hysteretic(self.operator)

    @property
    def slope(self) -> float:
        """The operator's reference slope plus the linear part."""
        return self._plain.slope + self.linear

    @property
    def n_memory(self) -> int:
        """Memory of the operator."""
        return self.operator.n_memory

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Return the operator's own initial memory at `s`."""
        return self._plain.initial_memory(s)

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Return the derivative of the operator's initial memory at `s`."""
        return self._plain.memory_sensitivity(s)

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Memory of the operator at `s`."""
        return self._plain.advance(ops, s, memory, p)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Operator less its reference slope: the linear part is all in `slope`."""
        return self._plain.deviation(ops, s, memory, p)
