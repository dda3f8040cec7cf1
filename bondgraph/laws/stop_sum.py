"""A law with memory whose heights are parameters: a sum of stops (Maxwell slip)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.elements import Parameter
from bondgraph.hysteresis.plays.play import play
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class StopSum(Law):
    """Prandtl-Ishlinskii law of stop type: ``sign * sum_i h_i (s - play_{r_i}[s])``.

    With ``h_i >= 0`` every stop is a spring with a slip: the law is passive (a Maxwell slip
    element in a storage). Thresholds are fixed, heights are parameters.

    Parameters
    ----------
    thresholds : tuple of float
        ``r_i > 0`` in units of `s`.
    height : float
        Start value of each ``h_i``, output units per unit of `s`.
    sign : float
        +1 in a storage; -1 where the output lags the argument (drive, sensor).
    """

    thresholds: tuple[NonNegative, ...] = (1.0,)
    height: float = 0.0
    scale: float = 1.0
    sign: float = 1.0
    unit: str = "1"
    starts: ClassVar[tuple[str, ...]] = ("height", "scale", "unit")
    name: ClassVar[str] = "prandtl_ishlinskii"
    energy: ClassVar[str] = "dissipates"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Return the heights ``h_i``."""
        return tuple(
            Parameter(f"h_{i}_{element}", self.height, self.unit, lower=0.0, scale=self.scale)
            for i in range(1, len(self.thresholds) + 1)
        )

    @property
    def n_memory(self) -> int:
        """One play state for each threshold."""
        return len(self.thresholds)

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Relaxed at `s`."""
        return (s,) * self.n_memory

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Relaxed memory follows `s`."""
        return (1.0,) * self.n_memory

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Each play moved to `s`."""
        return tuple(play(ops, s, r, y) for r, y in zip(self.thresholds, memory, strict=True))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Weighted stops at `s`."""
        total: Any = 0.0
        for h, y in zip(p, self.advance(ops, s, memory, p), strict=True):
            total = total + h * (s - y)
        return self.sign * total
