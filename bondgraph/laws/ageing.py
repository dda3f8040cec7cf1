"""A slope that changes while it is recorded: warming, wear, a leaking gas spring."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.clocked import Clocked
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Ageing(Clocked):
    """``s (a t / T + b (t / T)^2)``, `t` from the start of the run.

    Parameters
    ----------
    duration : float
        ``T``, s; a fixed parameter.
    size : float
        Typical change of the slope, units of the slope.

    Examples
    --------
    >>> law = Ageing(600.0, 0.2)
    >>> [p.name for p in law.parameters("k")]
    ['a_t_k', 'b_t_k', 'T_k']
    """

    duration: Positive = 1.0
    size: Positive = 1.0
    unit: str = "1"
    starts: ClassVar[tuple[str, ...]] = ("duration", "size", "unit")
    name: ClassVar[str] = "ageing"
    meanings: ClassVar[Mapping[str, str]] = {
        "a_t": "change of the coefficient over the record that grows with time",
        "b_t": "change over the record that grows with the square of time",
        "T": "duration of the record",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Linear and quadratic change over the record, duration of the record."""
        return (
            Parameter(f"a_t_{element}", 0.0, self.unit, positive=False, scale=self.size),
            Parameter(f"b_t_{element}", 0.0, self.unit, positive=False, scale=self.size),
            Parameter(f"T_{element}", self.duration, "s", fixed=True),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Change of the slope at the end of the step, times `s`."""
        a, b, duration, step = p
        t = (memory[0] + step) / duration
        return s * t * (a + b * t)
