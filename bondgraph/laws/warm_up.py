"""A zero that settles: what warms up moves towards its level, ever slower."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.clocked import Clocked
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops

SLOWEST, FASTEST = 20.0, 0.02
"""How far the time constant may move from its start value, as factors."""


@dataclass(frozen=True)
class WarmUp(Clocked):
    """``h (1 - exp(-t / tau))``, `t` from the start of the run, whatever `s` is.

    Parameters
    ----------
    pace : float
        Start value of the time constant, s.
    size : float
        Typical height, output units.

    Examples
    --------
    >>> [p.name for p in WarmUp(30.0).parameters("x")]
    ['h_x', 'tau_x']
    """

    pace: Positive = 1.0
    size: Positive = 1.0
    unit: str = "N"
    starts: ClassVar[tuple[str, ...]] = ("pace", "size", "unit")
    name: ClassVar[str] = "warm_up"
    meanings: ClassVar[Mapping[str, str]] = {
        "h": "what it has moved by in the end",
        "tau": "time constant with which it settles",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Height and time constant."""
        t = self.pace
        return (
            Parameter(f"h_{element}", 0.0, self.unit, positive=False, scale=self.size),
            Parameter(f"tau_{element}", t, "s", lower=FASTEST * t, upper=SLOWEST * t, scale=t),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Value at the end of the step."""
        height, tau, step = p
        return height * (1 - ops.exp(-(memory[0] + step) / tau))
