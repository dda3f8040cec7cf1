"""A resistor that lets no more than a limited current pass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.shared_slope import SharedSlope
from bondgraph.support.ops import Ops

STEEP = 100.0
"""Times its own resistance that it has beyond a limit: an effort ten times that of the limit
drives a tenth more than it."""


@dataclass(frozen=True, kw_only=True)
class CurrentLimit(SharedSlope):
    """``100 R max(f - high, 0) - 100 R max(low - f, 0)`` beside ``R f``: the flow stays in limits.

    The output stage of an amplifier behind its inner resistance: into a capacitive load the limit
    is one of the slope of the voltage, ``dU/dt = I / C``. It gives and takes unlike currents as a
    rule.

    Parameters
    ----------
    low, high : float
        Start values of the limits, flow units.

    Examples
    --------
    >>> law = CurrentLimit(coefficient="r", low=-0.2, high=0.3)
    >>> [p.name for p in law.parameters("r")]
    ['r', 'low_r', 'high_r']
    """

    low: float = -1.0
    high: float = 1.0
    unit: str = "A"
    starts: ClassVar[tuple[str, ...]] = (*SharedSlope.shared, "low", "high", "unit")
    name: ClassVar[str] = "current_limit"
    meanings: ClassVar[Mapping[str, str]] = {
        "k_own": "resistance between the limits",
        "low": "least flow that it lets pass",
        "high": "largest flow that it lets pass",
    }
    energy: ClassVar[str] = "dissipates"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Resistance, then the lower and the upper limit."""
        scale = 0.1 * (self.high - self.low)
        ends = {"low": self.low, "high": self.high}
        return (
            self.slope_parameter(element),
            *(
                Parameter(f"{n}_{element}", v, self.unit, positive=False, scale=scale)
                for n, v in ends.items()
            ),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Effort beyond a limit, less that of the resistance."""
        resistance, low, high = p
        beyond = ops.maximum(s - high, 0.0) - ops.maximum(low - s, 0.0)
        return STEEP * self.own_slope(resistance) * beyond
