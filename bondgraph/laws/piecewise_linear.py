"""A law without a name: piecewise-linear deviation on fixed knots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Rising
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class PiecewiseLinear(Law):
    """``sum_j c_j hat_j(s)``: any memoryless curve, zero at the two inner reference knots.

    Fixing two knots keeps offset and slope with the linear element.

    Examples
    --------
    >>> law = PiecewiseLinear((-2e-3, -1e-3, 1e-3, 2e-3))
    >>> [p.name for p in law.parameters("k")]
    ['c_0_k', 'c_3_k']
    """

    knots: Rising = (-1.0, -0.5, 0.5, 1.0)
    size: float = 1.0
    unit: str = "1"
    starts: ClassVar[tuple[str, ...]] = ("size", "unit")
    name: ClassVar[str] = "unnamed_curve"
    meanings: ClassVar[Mapping[str, str]] = {
        "c_i": "height of the curve at each knot",
    }
    energy: ClassVar[str] = "signal"

    @property
    def free_knots(self) -> tuple[int, ...]:
        """Knots with a height of their own."""
        n = len(self.knots)
        fixed = {n // 3, n - 1 - n // 3}
        return tuple(i for i in range(n) if i not in fixed)

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Heights at the free knots."""
        return tuple(
            Parameter(f"c_{i}_{element}", 0.0, self.unit, positive=False, scale=self.size)
            for i in self.free_knots
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Sum of hats, extended straight beyond the outer knots."""
        heights: dict[int, Any] = dict(zip(self.free_knots, p, strict=True))
        value = [heights.get(i, 0.0) for i in range(len(self.knots))]
        total = value[0]
        last = len(self.knots) - 1
        for i in range(last):
            a, b = self.knots[i], self.knots[i + 1]
            inside = s - a if i == 0 else ops.maximum(s - a, 0.0)
            clipped = inside if i == last - 1 else ops.minimum(inside, b - a)
            total = total + (value[i + 1] - value[i]) / (b - a) * clipped
        return total
