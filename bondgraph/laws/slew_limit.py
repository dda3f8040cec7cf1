"""A drive whose output can change only so fast: the slew rate of an amplifier or a valve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import Ops

FASTEST = 1e-100
"""Slowness that stands for no limit at all: no division by zero, not even in its derivative."""


@dataclass(frozen=True)
class SlewLimit(Law):
    """Output follows the command by at most ``h / slowness`` within a step of `h` seconds.

    The parameter is the slowness, one over the slew rate: zero is no limit, and the time that a
    jump takes is proportional to it. Memory is the output at the last accepted step.

    Parameters
    ----------
    slowness : float
        Start value, s per unit of the command.
    size : float
        Typical slowness; what it takes to cross the range within the record is plenty.
    unit : str
        Unit of the slowness.
    even : bool
        Whether both directions are limited alike; if not, `slowness` is that of rising commands.
    falling : float
        Start value for falling commands where they are limited on their own.

    Examples
    --------
    >>> law = SlewLimit(0.02)
    >>> [p.name for p in law.parameters("F")]
    ['slowness_F']
    """

    slowness: NonNegative = 0.01
    size: Positive = 0.01
    unit: str = "s/V"
    even: bool = True
    falling: NonNegative = 0.01
    starts: ClassVar[tuple[str, ...]] = ("slowness", "size", "unit", "falling")
    name: ClassVar[str] = "slew_limit"
    meanings: ClassVar[Mapping[str, str]] = {
        "slowness": "time to follow a unit of the command, upwards where falling is its own",
        "falling": "time to follow a unit of the command, downwards",
    }
    lives_in_time: ClassVar[bool] = True
    """The largest change is proportional to the step."""
    follows: ClassVar[tuple[bool, ...]] = (True,)
    """Output at the last step."""

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Slowness, of both directions or of each."""
        values = {"slowness": self.slowness}
        if not self.even:
            values["falling"] = self.falling
        return tuple(
            Parameter(f"{n}_{element}", v, self.unit, lower=0.0, scale=self.size)
            for n, v in values.items()
        )

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Output, at most one largest change away from the last."""
        *slowness, step = p
        up, down = (step / ops.maximum(slowness[i], FASTEST) for i in (0, -1))
        last = memory[0]
        return (last + ops.maximum(-down, ops.minimum(up, s - last)),)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """How far the output stays behind the command."""
        return self.advance(ops, s, memory, p)[0] - s
