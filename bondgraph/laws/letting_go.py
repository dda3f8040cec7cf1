"""A damper in the gap of a coupling: it lets go where the spring does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.watching import WatchingLaw
from bondgraph.support.bounds import NonNegative, Positive, Signal
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class LettingGo(WatchingLaw):
    """``-R f`` while ``|q - centre| < w``, beside ``R f``: no damping within the gap.

    Contact with spring and damper behind a dead zone: Nordin and Gutman, Controlling mechanical
    systems with backlash, Automatica 38 (2002) 1633, section 2. It grips over `depth` behind the
    gap, which keeps the force from jumping.

    Parameters
    ----------
    beside : str
        Signal of the displacement ``q``, such as ``q_k``.
    coefficient : str
        Name of the resistor's own parameter ``R``; "" for one of the law's own.
    resistance, width, centre : float
        Start values of ``R``, of half the gap ``w`` and of its middle.
    depth : float
        Way over which it grips, fixed.
    size : float
        Typical displacement.

    Examples
    --------
    >>> law = LettingGo("q_k", "d", width=1e-3)
    >>> [p.name for p in law.parameters("d")]
    ['d', 'gap_d', 'centre_d', 'depth_d']
    """

    beside: Signal
    coefficient: str = ""
    resistance: Positive = 1.0
    width: NonNegative = 0.1
    centre: float = 0.0
    depth: Positive = 0.01
    size: Positive = 1.0
    unit: str = "N*s/m"
    way_unit: str = "m"
    starts: ClassVar[tuple[str, ...]] = (
        "beside", "coefficient", "resistance", "width", "centre", "depth", "size", "unit",
        "way_unit",
    )  # fmt: skip
    name: ClassVar[str] = "letting_go"
    meanings: ClassVar[Mapping[str, str]] = {
        "R_own": "resistance outside of the gap",
        "gap": "half the width of the gap without damping",
        "centre": "middle of that gap",
        "depth": "way over which it grips behind the gap",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``R``, half width, middle, then the fixed depth."""
        r, scale, way = self.resistance, 0.1 * self.size, self.way_unit
        return (
            Parameter(self.coefficient or f"R_own_{element}", r, self.unit, scale=r),
            Parameter(f"gap_{element}", self.width, way, lower=0.0, scale=scale),
            Parameter(f"centre_{element}", self.centre, way, positive=False, scale=scale),
            Parameter(f"depth_{element}", self.depth, way, fixed=True),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Force that is missing within the gap."""
        r, width, centre, depth = p
        behind = (ops.absolute(self.seen(memory) - centre) - width) / depth
        return -r * s * (1.0 - ops.maximum(0.0, ops.minimum(1.0, behind)))
