"""Turbulent flow through a small hole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.friction import square_drag_flow
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Orifice(Law):
    """Effort ``level f |f| / full^2``: the flow grows with the root of the effort.

    `QuadraticDrag` by what it lets pass, which is nothing where there is no hole. Torricelli 1643;
    Merritt, Hydraulic Control Systems, 1967, chapter 3.

    Parameters
    ----------
    full : float
        Start value of the flow at the effort `level`.
    level : float
        Reference effort, a fixed parameter.

    Examples
    --------
    >>> law = Orifice(1e-4, 1e5)
    >>> [p.name for p in law.parameters("valve")]
    ['full_valve', 'level_valve']
    """

    full: Positive = 1.0
    level: Positive = 1.0
    unit: str = "m3/s"
    level_unit: str = "Pa"
    starts: ClassVar[tuple[str, ...]] = ("full", "level", "unit", "level_unit")
    name: ClassVar[str] = "orifice"
    meanings: ClassVar[Mapping[str, str]] = {
        "full": "flow at the reference effort",
        "level": "reference effort",
    }
    energy: ClassVar[str] = "dissipates"
    closed: ClassVar[bool] = True

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Flow at the reference effort, then the fixed effort."""
        return (
            Parameter(
                f"full_{element}", self.full, self.unit, lower=1e-6 * self.full, scale=self.full
            ),
            Parameter(f"level_{element}", self.level, self.level_unit, fixed=True),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """``level f |f| / full^2``."""
        return p[1] * s * ops.absolute(s) / p[0] ** 2

    def solve(
        self, s_free: Any, gain: Any, memory: Sequence[Any], p: Sequence[Any], w_last: Any
    ) -> Any:
        """Drag at the flow that it leaves."""
        import casadi as ca

        k = p[1] / p[0] ** 2
        f = square_drag_flow(s_free, gain, k)
        return k * f * ca.fabs(f)
