"""Steps towards the root of an equation that laws have no formula for; whoever runs them stops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Iteration:
    """The arguments ``s = free + gain w``, ``w = law(s)``, step by step; CasADi in and out.

    Attributes
    ----------
    begin : callable
        ``(free, gain, w_last) -> numbers``: arguments first, then whatever the steps carry.
    step : callable
        ``(numbers, free, gain) -> numbers``
    end : callable
        ``numbers -> w``
    size, arguments : int
        How many numbers there are, and how many of them are arguments. Where these stand still, it
        has ended.
    most : int
        Steps that are always enough.
    """

    begin: Callable[[Any, Any, Any], Any]
    step: Callable[[Any, Any, Any], Any]
    end: Callable[[Any], Any]
    size: int
    arguments: int
    most: int

    def solved(self, free: Any, gain: Any, w_last: Any) -> Any:
        """Return the deviations after all steps, as one expression."""
        numbers = self.begin(free, gain, w_last)
        for _ in range(self.most):
            numbers = self.step(numbers, free, gain)
        return self.end(numbers)
