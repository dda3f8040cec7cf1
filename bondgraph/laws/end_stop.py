"""Stiff contact at the end of a stroke."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Positive, one_of
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class EndStop(Law):
    """``k_s max(q - high, 0) - k_s max(low - q, 0)``: a lossless stop on one side or both.

    Sharp elastic impact, restitution 1. Piecewise linear stops: Shaw, J. Applied Mechanics 52
    (1985) 453.

    Parameters
    ----------
    stiffness : float
        Start value of ``k_s``; it stays between a fifth and a hundredfold.
    low, high : float
        Start values of the gaps.
    sides : {"both", "low", "high"}
        Which stops there are.
    size : float
        Typical displacement.

    Examples
    --------
    >>> law = EndStop(5e4, high=2e-3, sides="high")
    >>> [p.name for p in law.parameters("k")]
    ['k_s_k', 'high_k']
    """

    stiffness: Positive = 10.0
    low: float = -0.8
    high: float = 0.8
    sides: Annotated[str, one_of("both", "low", "high")] = "both"
    size: Positive = 1.0
    unit: str = "m"
    slope_unit: str = "N/m"
    starts: ClassVar[tuple[str, ...]] = ("stiffness", "low", "high", "size", "unit", "slope_unit")
    name: ClassVar[str] = "end_stop"
    meanings: ClassVar[Mapping[str, str]] = {
        "k_s": "stiffness of the stop",
        "low": "displacement at which the lower stop is met",
        "high": "displacement at which the upper stop is met",
    }
    energy: ClassVar[str] = "stores"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Stiffness, then the low and the high gap, those that there are."""
        k, scale = self.stiffness, 0.1 * self.size
        gaps = {"low": self.low, "high": self.high}
        return (
            Parameter(
                f"k_s_{element}", k, self.slope_unit, lower=0.2 * k, upper=100.0 * k, scale=k
            ),
            *(
                Parameter(f"{n}_{element}", v, self.unit, positive=False, scale=scale)
                for n, v in gaps.items()
                if self.sides in (n, "both")
            ),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Contact effort."""
        total: Any = 0.0
        if self.sides != "low":
            total = ops.maximum(s - p[-1], 0.0)
        if self.sides != "high":
            total = total - ops.maximum(p[1] - s, 0.0)
        return p[0] * total
