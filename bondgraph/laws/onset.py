"""A disturbance that sets in: a step or a ramp in time that the motion does not touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.elements import Parameter
from bondgraph.laws.clocked import Clocked
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Onset(Clocked):
    """``h (1 + tanh((t - t_0) / width)) / 2``, or its integral over time, whatever `s` is.

    Parameters
    ----------
    time : float
        Start value of ``t_0``, s from the start of the run.
    width : float
        Start value of the rise time, s.
    margin : float
        How far ``t_0`` may move either way, s.
    size : float
        Typical height, output units (per second for a ramp).
    ramp : bool
        The integral of the step: a flow that sets in, seen as a displacement.
    free_standing : bool
        The element is nothing but the disturbance; otherwise the deviation is added to its slope.
    """

    time: float = 1.0
    width: Positive = 0.01
    margin: Positive = 0.1
    size: Positive = 1.0
    unit: str = "N"
    ramp: bool = False
    free_standing: bool = True
    starts: ClassVar[tuple[str, ...]] = ("time", "width", "margin", "size", "unit")
    name: ClassVar[str] = "onset"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Height, time, rise time."""
        t, m = self.time, self.margin
        return (
            Parameter(f"h_{element}", 0.0, self.unit, positive=False, scale=self.size),
            Parameter(
                f"t_0_{element}", t, "s", positive=False, lower=t - m, upper=t + m, scale=0.1 * m
            ),
            Parameter(
                f"rise_{element}",
                self.width,
                "s",
                lower=1e-2 * self.width,
                upper=m,
                scale=self.width,
            ),
        )

    @property
    def slope(self) -> float | None:
        """None of its own if free standing."""
        return 0.0 if self.free_standing else None

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Value at the end of the step."""
        height, begin, width, step = p
        return height * begun(ops, memory[0] + step - begin, width, ramp=self.ramp)


def begun(ops: Ops, since: Any, width: Any, *, ramp: bool) -> Any:
    """Return a unit step that rises over `width`, or its integral, at `since` after its middle."""
    z = since / width
    if not ramp:
        return 0.5 * (1 + ops.tanh(z))
    # 0.5 (z + log(2 cosh z)), written so that no exponential overflows
    size = ops.absolute(z)
    return 0.5 * width * (z + size + ops.log(1 + ops.exp(-2 * size)))
