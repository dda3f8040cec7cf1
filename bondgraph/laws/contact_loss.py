"""A preloaded contact that cannot pull."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.shared_slope import SharedSlope
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True, kw_only=True)
class ContactLoss(SharedSlope):
    """``side k max(side (lift - q), 0)``: beyond `lift` the effort stays at the preload.

    With ``side = 1`` the effort never falls below ``k lift`` (a preload pressed ``-lift`` long),
    with ``side = -1`` it never rises above. Unilateral contact: Brogliato, Nonsmooth Mechanics,
    3rd ed. 2016. ``lift = edge + side depth``: at ``depth = 0`` the contact opens at `edge`,
    which should lie outside the motion.

    Parameters
    ----------
    depth : float
        Start value of the depth.
    size : float
        Typical displacement.
    edge, side : float
        Known numbers; fixed parameters.

    Examples
    --------
    >>> law = ContactLoss(coefficient="k", edge=-1e-3)
    >>> [p.name for p in law.parameters("k")]
    ['k', 'depth_k', 'edge_k', 'side_k']
    """

    depth: float = 0.5
    size: Positive = 1.0
    edge: float = -1.0
    side: float = 1.0
    unit: str = "m"
    starts: ClassVar[tuple[str, ...]] = (
        *SharedSlope.shared, "depth", "size", "edge", "side", "unit",
    )  # fmt: skip
    name: ClassVar[str] = "contact_loss"
    meanings: ClassVar[Mapping[str, str]] = {
        "k_own": "stiffness while in contact",
        "depth": "how far the point of opening lies within the motion",
        "edge": "end of the motion that the depth counts from",
        "side": "on which side it opens",
    }
    energy: ClassVar[str] = "stores"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Stiffness, depth, then the fixed edge and side."""
        return (
            self.slope_parameter(element),
            Parameter(f"depth_{element}", self.depth, self.unit, lower=0.0, scale=0.1 * self.size),
            Parameter(f"edge_{element}", self.edge, self.unit, positive=False, fixed=True),
            Parameter(f"side_{element}", self.side, "1", positive=False, fixed=True),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Effort of the pull that does not come."""
        k, depth, edge, side = p
        return side * self.own_slope(k) * ops.maximum(side * (edge - s) + depth, 0.0)
