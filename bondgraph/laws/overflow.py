"""A store that spills what it cannot hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.shared_slope import SharedSlope
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True, kw_only=True)
class Overflow(SharedSlope):
    """``-k spilled``; the spilled volume grows when more than the limit is inside.

    ``spilled+ = max(spilled, q - (top - depth))`` is a one-sided play on what has flowed in; `q`
    keeps counting what has flowed in, ``q - spilled`` is inside. A rim without resistance: the
    level never stands above it.

    Parameters
    ----------
    depth : float
        Start value of the distance of the rim below `top`.
    size : float
        Typical displacement.
    top : float
        Level that is never reached; a fixed parameter.

    Examples
    --------
    >>> law = Overflow(coefficient="k", top=0.5)
    >>> [p.name for p in law.parameters("k")]
    ['k', 'depth_k', 'top_k']
    """

    depth: float = 0.5
    size: Positive = 1.0
    top: float = 1.0
    unit: str = "m3"
    starts: ClassVar[tuple[str, ...]] = (*SharedSlope.shared, "depth", "size", "top", "unit")
    name: ClassVar[str] = "overflow"
    meanings: ClassVar[Mapping[str, str]] = {
        "k_own": "slope of the store",
        "depth": "how far the rim lies below top: it spills above a content of top - depth",
        "top": "a content that is never reached, from which the rim is counted down",
    }
    energy: ClassVar[str] = "dissipates"
    follows: ClassVar[tuple[bool, ...]] = (False,)
    """Spilled so far."""

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Slope of the store, depth, then the fixed top."""
        return (
            self.slope_parameter(element),
            Parameter(f"depth_{element}", self.depth, self.unit, lower=0.0, scale=0.1 * self.size),
            Parameter(f"top_{element}", self.top, self.unit, positive=False, fixed=True),
        )

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Spill what stands above the rim."""
        return (ops.maximum(memory[0], s - p[2] + p[1]),)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Effort that the spilled part would have had."""
        return -self.own_slope(p[0]) * self.advance(ops, s, memory, p)[0]
