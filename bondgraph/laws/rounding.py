"""A converter that knows few values: rounding to the nearest of an even grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Expression, Ops

CONSTANT = 1e-10
"""Sub-division of a step within which the rounding error counts as constant."""


def _error(ops: Ops, z: Expression) -> Expression:
    return ops.floor(z + 0.5) - CONSTANT * ops.floor(z / CONSTANT + 0.5)


LEAST = 0.5
"""Part of the rounding error that a reading has at least if it is rounded."""


@dataclass(frozen=True)
class Rounding(Law):
    """``s + amount (rounded - s)`` with `rounded` the nearest of ``origin + k step``.

    Step and origin are read off a recording, not fitted, and the rounding error counts as a number
    that the parameters of the model do not move: its derivative is zero everywhere (of the true
    one, -1 between jumps without bound, nothing could be learnt by descent). The price is an error
    of at most ``1e-10 step``, on grids of up to 1e5 values.

    Parameters
    ----------
    step : float
        Distance of two values, units of `s`.
    origin : float
        Any value of the grid.
    amount : float
        Start value; 1 rounds fully.

    Examples
    --------
    >>> law = Rounding(1e-6)
    >>> [p.name for p in law.parameters("x")]
    ['amount_x', 'step_x', 'origin_x']
    """

    step: Positive = 1.0
    origin: float = 0.0
    amount: float = 1.0
    unit: str = "1"
    starts: ClassVar[tuple[str, ...]] = ("step", "origin", "amount", "unit")
    name: ClassVar[str] = "rounding"
    meanings: ClassVar[Mapping[str, str]] = {
        "amount": "how much is rounded: 0 nothing, 1 all",
        "step": "step of the grid",
        "origin": "a point of the grid",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Amount; step and origin fixed."""
        return (
            Parameter(
                f"amount_{element}", self.amount, positive=False, lower=LEAST, upper=1.5, scale=0.3
            ),
            Parameter(f"step_{element}", self.step, self.unit, fixed=True),
            Parameter(f"origin_{element}", self.origin, self.unit, positive=False, fixed=True),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return the rounding error, constant within a small part of a step."""
        amount, step, origin = p
        return amount * step * _error(ops, (s - origin) / step)


@dataclass(frozen=True)
class Resolution(Law):
    """``s`` rounded to the nearest multiple of `step`: the `resolution` of a sensor.

    The error counts as in `Rounding`: what is read follows through it, and the step is known.
    """

    step: Positive = 1.0
    starts: ClassVar[tuple[str, ...]] = ("step",)
    name: ClassVar[str] = "resolution"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Return the step, fixed."""
        return (Parameter(f"resolution_{element}", self.step, fixed=True),)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return the rounding error, constant within a small part of a step."""
        (step,) = p
        return step * _error(ops, s / step)
