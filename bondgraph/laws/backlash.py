"""Free play in a spring."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.shared_slope import SharedSlope
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True, kw_only=True)
class Backlash(SharedSlope):
    """``-k (clip(q - centre, -w, w) - clip(-centre, -w, w))``: free play beside ``k q``.

    Within the gap the effort does not change. A relaxed spring has ``q = 0`` in the gap, which
    then carries no effort; with the gap elsewhere the constant part of the load keeps ``q = 0``.
    Dead band in series with an elastic shaft: Nordin and Gutman, Controlling mechanical systems
    with backlash, Automatica 38 (2002) 1633.

    Parameters
    ----------
    width : float
        Start value of half the gap ``w``.
    centre : float
        Start value of its middle.
    size : float
        Typical displacement.

    Examples
    --------
    >>> law = Backlash(coefficient="k", width=2e-4)
    >>> [p.name for p in law.parameters("k")]
    ['k', 'gap_k', 'centre_k']
    """

    width: NonNegative = 0.1
    centre: float = 0.0
    size: Positive = 1.0
    unit: str = "m"
    starts: ClassVar[tuple[str, ...]] = (*SharedSlope.shared, "width", "centre", "size", "unit")
    name: ClassVar[str] = "backlash"
    meanings: ClassVar[Mapping[str, str]] = {
        "gap": "half the width of the free play",
        "centre": "middle of the free play",
        "k_own": "stiffness outside of the free play",
    }
    energy: ClassVar[str] = "stores"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Stiffness, half width and middle of the gap."""
        scale = 0.1 * self.size
        return (
            self.slope_parameter(element),
            Parameter(f"gap_{element}", self.width, self.unit, lower=0.0, scale=scale),
            Parameter(f"centre_{element}", self.centre, self.unit, positive=False, scale=scale),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Effort that the gap takes away."""
        k, width, centre = p
        lost = ops.maximum(-width, ops.minimum(width, s - centre))
        return -self.own_slope(k) * (lost - ops.maximum(-width, ops.minimum(width, -centre)))
