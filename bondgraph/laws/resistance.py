"""A resistor whose characteristic bends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class NonlinearResistance(Law):
    """``a_2 z^2 + a_3 z^3`` with ``z = f / level``; `a` in units of effort.

    The first two terms of a characteristic through the origin beside ``R f``. The quadratic one
    makes it differ between the directions, the cubic one keeps it odd. Passive while the whole
    ``R f + a_2 z^2 + a_3 z^3`` has the sign of ``f``; alone it promises nothing.

    Parameters
    ----------
    size : float
        Typical effort.
    level : float
        Reference flow, a fixed parameter.

    Examples
    --------
    >>> law = NonlinearResistance(level=0.1)
    >>> [p.name for p in law.parameters("r")]
    ['a_2_r', 'a_3_r', 'level_r']
    """

    size: Positive = 1.0
    level: Positive = 1.0
    unit: str = "V"
    flow_unit: str = "A"
    starts: ClassVar[tuple[str, ...]] = ("size", "level", "unit", "flow_unit")
    name: ClassVar[str] = "nonlinear_resistance"
    meanings: ClassVar[Mapping[str, str]] = {
        "a_2": "even part of the curve, as the effort at the reference flow",
        "a_3": "odd part of the curve, as the effort at the reference flow",
        "level": "reference flow",
    }
    energy: ClassVar[str] = "signal"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Quadratic and cubic coefficient, then the fixed level."""
        return (
            *(
                Parameter(f"a_{j}_{element}", 0.0, self.unit, positive=False, scale=self.size)
                for j in (2, 3)
            ),
            Parameter(f"level_{element}", self.level, self.flow_unit, fixed=True),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Sum of both powers."""
        z = s / p[2]
        return p[0] * z**2 + p[1] * z**3
