"""A counter that begins anew after each turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.laws.law import Law
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Wrapping(Law):
    """``s`` less whole turns, from `low` to `low` plus a turn.

    Between its jumps the reading follows. Fits and diagnoses take the readings of a sensor with
    this law straight, recorded and simulated ones: a jump a sample late is an error of a turn.

    Parameters
    ----------
    turn : float
        One turn, units of `s`.
    low : float
        Where a turn begins.

    Examples
    --------
    >>> law = Wrapping(6.283185307179586)
    >>> [p.name for p in law.parameters("angle")]
    []
    """

    turn: Positive = 1.0
    low: float = 0.0
    name: ClassVar[str] = "wrapping"

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return the whole turns, to be taken away."""
        return -self.turn * ops.floor((s - self.low) / self.turn)
