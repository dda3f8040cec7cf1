"""Limits of an amplifier: saturation and dead zone, as deviations from the identity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative
from bondgraph.support.ops import Ops


def soft_excess(ops: Ops, z: Any, width: Any) -> Any:
    """Return ``max(z, 0)`` with a rounded corner of half width `width`."""
    return 0.5 * (z + ops.sqrt(z * z + width * width))


@dataclass(frozen=True)
class Saturation(Law):
    """Output follows the command between two limits and bends flat outside, with a soft knee.

    Parameters
    ----------
    low, high : float
        Start values of the limits, units of the command.
    knee : float
        Start value of the rounding.

    Examples
    --------
    >>> law = Saturation(-10.0, 10.0)
    >>> [p.name for p in law.parameters("F")]
    ['low_F', 'high_F', 'knee_F']
    """

    low: float = -1.0
    high: float = 1.0
    knee: NonNegative = 0.05
    unit: str = "V"
    starts: ClassVar[tuple[str, ...]] = ("low", "high", "knee", "unit")
    name: ClassVar[str] = "saturation"
    meanings: ClassVar[Mapping[str, str]] = {
        "low": "lower limit of the output",
        "high": "upper limit of the output",
        "knee": "how gradually it bends into the limits",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Lower limit, upper limit, knee."""
        size = self.high - self.low
        return (
            Parameter(f"low_{element}", self.low, self.unit, positive=False, scale=0.1 * size),
            Parameter(f"high_{element}", self.high, self.unit, positive=False, scale=0.1 * size),
            Parameter(
                f"knee_{element}",
                self.knee,
                self.unit,
                lower=1e-4 * size,
                upper=0.5 * size,
                scale=0.05 * size,
            ),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return what is cut off, negative above the upper limit."""
        low, high, knee = p
        return soft_excess(ops, low - s, knee) - soft_excess(ops, s - high, knee)


@dataclass(frozen=True)
class DeadZone(Law):
    """No response within ``centre +- width``, identity less the width outside.

    Examples
    --------
    >>> law = DeadZone(0.0, 0.3)
    >>> [p.name for p in law.parameters("F")]
    ['width_F', 'centre_F']
    """

    centre: float = 0.0
    width: NonNegative = 0.1
    size: float = 1.0
    unit: str = "V"
    starts: ClassVar[tuple[str, ...]] = ("centre", "width", "size", "unit")
    name: ClassVar[str] = "dead_zone"
    meanings: ClassVar[Mapping[str, str]] = {
        "width": "half the range of the command without a response",
        "centre": "middle of that range",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Half width and centre."""
        return (
            Parameter(f"width_{element}", self.width, self.unit, lower=0.0, scale=self.width),
            Parameter(
                f"centre_{element}", self.centre, self.unit, positive=False, scale=0.1 * self.size
            ),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """``-clip(s - centre, -width, width)``: what the command loses."""
        width, centre = p
        return -ops.maximum(-width, ops.minimum(width, s - centre))
