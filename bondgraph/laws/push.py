"""A disturbance that sets in and ends: a push in time that the motion does not touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.elements import Parameter
from bondgraph.laws.clocked import Clocked
from bondgraph.laws.onset import begun
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Push(Clocked):
    """A step of height ``h`` at ``t_0`` that is taken back at ``t_1``, or its integral over time.

    Parameters
    ----------
    time, end : float
        Start values of ``t_0`` and ``t_1``, s from the start of the run.
    width : float
        Start value of the time over which it sets in and ends, s.
    margin : float
        How far ``t_0`` and ``t_1`` may move either way, s.
    size : float
        Typical height, output units (per second for an integral).
    ramp : bool
        The integral of the push: a flow for a while, seen as a displacement.
    free_standing : bool
        The element is nothing but the disturbance; otherwise the deviation is added to its slope.
    """

    time: float = 1.0
    end: float = 2.0
    width: Positive = 0.01
    margin: Positive = 0.1
    size: Positive = 1.0
    unit: str = "N"
    ramp: bool = False
    free_standing: bool = True
    starts: ClassVar[tuple[str, ...]] = ("time", "end", "width", "margin", "size", "unit")
    name: ClassVar[str] = "push"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Height, begin, end, rise time."""
        m = self.margin

        def moment(name: str, t: float) -> Parameter:
            lower, upper = t - m, t + m
            return Parameter(
                f"{name}_{element}", t, "s", positive=False, lower=lower, upper=upper, scale=0.1 * m
            )

        low, wide = 1e-2 * self.width, max(m, self.width)
        return (
            Parameter(f"h_{element}", 0.0, self.unit, positive=False, scale=self.size),
            moment("t_0", self.time),
            moment("t_1", self.end),
            Parameter(f"rise_{element}", self.width, "s", lower=low, upper=wide, scale=self.width),
        )

    @property
    def slope(self) -> float | None:
        """None of its own if free standing."""
        return 0.0 if self.free_standing else None

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Value at the end of the step."""
        height, begin, end, width, step = p
        now = memory[0] + step
        first, last = (begun(ops, now - t, width, ramp=self.ramp) for t in (begin, end))
        return height * (first - last)
