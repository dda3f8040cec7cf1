"""A force that repeats along the way: cogging, tooth ripple, a lead screw's error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.laws.trigonometry import amplitudes, wave
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Periodic(Law):
    """``a sin(2 pi s / period) + b cos(2 pi s / period)`` without any slope of its own.

    In a storage it derives from the energy ``(b sin - a cos) period / 2 pi`` and so stores.

    Parameters
    ----------
    period : float
        Start value of the period, units of `s`.
    size : float
        Typical amplitude, output units.
    reach : float
        Half range of `s`: over more periods the period is known better.

    Examples
    --------
    >>> law = Periodic(2e-3)
    >>> [p.name for p in law.parameters("k")]
    ['a_k', 'b_k', 'period_k']
    """

    period: Positive = 1.0
    size: Positive = 1.0
    reach: Positive = 1.0
    unit: str = "N"
    way_unit: str = "m"
    starts: ClassVar[tuple[str, ...]] = ("period", "size", "reach", "unit", "way_unit")
    name: ClassVar[str] = "periodic_force"
    meanings: ClassVar[Mapping[str, str]] = {
        "a": "amplitude of the sine along the way",
        "b": "amplitude of the cosine along the way",
        "period": "way after which it repeats",
    }
    energy: ClassVar[str] = "stores"
    own_origin: ClassVar[tuple[str, ...]] = ("a", "b")

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Sine and cosine amplitude, period."""
        p = self.period
        # the phase at the end of the range moves by a tenth of a turn
        scale = min(0.1 * p * p / self.reach, 0.1 * p)
        return (
            *amplitudes(element, self.unit, self.size),
            Parameter(
                f"period_{element}", p, self.way_unit, positive=False,
                lower=0.8 * p, upper=1.25 * p, scale=scale,
            ),
        )  # fmt: skip

    @property
    def slope(self) -> float:
        """No spring: the force alone."""
        return 0.0

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Force at the position `s`."""
        a, b, period = p
        return wave(ops, 2 * pi * s / period, a, b)
