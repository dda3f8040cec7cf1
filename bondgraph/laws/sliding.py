"""Friction that depends on how far a contact has slid: an operator of displacement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.hysteresis import Operator
from bondgraph.laws.law import Law
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Sliding(Law):
    """Friction force of an operator fed by the displacement since the start.

    Generalised Maxwell slip, Dahl or Bouc-Wen friction in a resistor: the resistor's value stays
    the viscous part. The displacement is the flow integrated by the trapezoidal rule over accepted
    steps and starts at 0, as does the flow before the first sample.

    Parameters
    ----------
    operator : Operator
        Force from displacement; passive with its output as effort, else the law may give energy.

    Examples
    --------
    >>> from bondgraph.hysteresis import MaxwellResistiveCapacitor
    >>> law = Sliding(MaxwellResistiveCapacitor((60.0, 40.0), (1e-4, 3e-4)))
    >>> [p.name for p in law.parameters("d")]
    []
    """

    operator: Operator
    name: ClassVar[str] = "sliding"
    lives_in_time: ClassVar[bool] = True
    """Displacement is the integral of flow over time."""

    @property
    def energy(self) -> str:  # type: ignore[override]
        """``dissipates`` if the operator is passive with its output as effort, else ``signal``."""
        return "dissipates" if self.operator.passive_port == "output" else "signal"

    @property
    def n_memory(self) -> int:
        """Displacement, last flow, then the operator's memory."""
        return 2 + self.operator.n_memory

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """No displacement yet, moving with `s`."""
        return (0.0, s, *(float(v) for v in self.operator.initial_memory(0.0)))

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Only the last flow follows `s`."""
        return (0.0, 1.0, *(0.0 for _ in range(self.operator.n_memory)))

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Slide on at flow `s`."""
        x = _slid(s, memory, p[-1])
        return (x, s, *self.operator.advance(ops, x, tuple(memory[2:]), p[-1]))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Force of the operator at the displacement reached."""
        return self.operator.value(ops, _slid(s, memory, p[-1]), tuple(memory[2:]), p[-1])


def _slid(s: Any, memory: Sequence[Any], step: Any) -> Any:
    return memory[0] + 0.5 * step * (memory[1] + s)
