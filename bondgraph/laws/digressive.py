"""Damping that grows less than the speed, and differs between the two directions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.shared_slope import SharedSlope
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True, kw_only=True)
class DigressiveDamping(SharedSlope):
    """Whole effort ``(R f + d |f|) / (1 + |f| / f_d)``: steep when slow, flat when fast.

    A vehicle damper whose valves open as it moves faster (Dixon, The Shock Absorber Handbook,
    2007). ``R`` is the mean resistance of both directions when slow, ``d`` half their difference.
    It is passive while ``|d| <= R``.

    Parameters
    ----------
    difference : float
        Start value of ``d``, units of the resistance.
    flow : float
        Start value of ``f_d``, at which half of the resistance is left.

    Examples
    --------
    >>> law = DigressiveDamping(coefficient="d", flow=0.2)
    >>> [p.name for p in law.parameters("d")]
    ['d', 'd_a_d', 'f_d_d']
    """

    difference: float = 0.0
    flow: Positive = 1.0
    flow_unit: str = "m/s"
    starts: ClassVar[tuple[str, ...]] = (*SharedSlope.shared, "difference", "flow", "flow_unit")
    name: ClassVar[str] = "digressive_damping"
    meanings: ClassVar[Mapping[str, str]] = {
        "k_own": "mean resistance when slow",
        "d_a": "half the difference of the resistance forwards and backwards, when slow",
        "f_d": "flow at which half of the resistance is left",
    }
    energy: ClassVar[str] = "signal"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Resistance when slow, half the difference of both directions, the flow."""
        size = self.stiffness
        return (
            self.slope_parameter(element),
            Parameter(
                f"d_a_{element}", self.difference, self.stiffness_unit, positive=False, scale=size
            ),
            Parameter(f"f_d_{element}", self.flow, self.flow_unit, scale=self.flow),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return what is left of both resistances, less the straight line."""
        straight, size = self.own_slope(p[0]) * s, ops.absolute(s)
        return (straight + p[1] * size) / (1.0 + size / p[2]) - straight
