"""A sensor that gives the size of a signal and loses its sign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Rectifier(Law):
    """``s + amount (|s| - s)``: nothing at 0, half wave at 1/2, full wave at 1.

    Parameters
    ----------
    amount : float
        Start value, between 0 and 1.

    Examples
    --------
    >>> law = Rectifier(1.0)
    >>> [p.name for p in law.parameters("u")]
    ['amount_u']
    """

    amount: float = 1.0
    starts: ClassVar[tuple[str, ...]] = ("amount",)
    name: ClassVar[str] = "rectifier"
    meanings: ClassVar[Mapping[str, str]] = {
        "amount": "how much of the sign is lost: 0 nothing, 1/2 half wave, 1 all",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Amount, bounded by 0 and a full wave with some room for a gain of its own."""
        return (
            Parameter(
                f"amount_{element}", self.amount, positive=False, lower=0.0, upper=1.2, scale=0.3
            ),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return what is turned over where `s` is negative."""
        return p[0] * (ops.absolute(s) - s)
