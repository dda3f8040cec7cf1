"""Laws that switch on at a moment; what an onset and a push share."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.clocked import Clocked
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Stepwise(Clocked, ABC):
    """A height from a moment on, or its integral over time, whatever `s` is; abstract.

    Parameters
    ----------
    time : float
        Start value of ``t_0``, s from the start of the run.
    width : float
        Start value of the rise time, s.
    margin : float
        How far moments may move either way, s.
    size : float
        Typical height, output units (per second for a ramp).
    ramp : bool
        The integral: a flow that sets in, seen as a displacement.
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

    @property
    def words(self) -> str:
        """Its own words, and that it is integrated if it is a ramp."""
        said = super().words
        return f"the integral over time of {said[0].lower()}{said[1:]}" if self.ramp else said

    @property
    def slope(self) -> float | None:
        """None of its own if free standing."""
        return 0.0 if self.free_standing else None

    def height(self, element: str) -> Parameter:
        """Return the height."""
        return Parameter(f"h_{element}", 0.0, self.unit, positive=False, scale=self.size)

    def moment(self, name: str, start: float) -> Parameter:
        """Return a moment near its start value."""
        m = self.margin
        return Parameter(
            name, start, "s", positive=False, lower=start - m, upper=start + m, scale=0.1 * m
        )

    def rise(self, element: str) -> Parameter:
        """Return the time over which it switches."""
        w = self.width
        return Parameter(f"rise_{element}", w, "s", lower=1e-2 * w, upper=self.margin, scale=w)

    def switched(self, ops: Ops, since: Any, width: Any) -> Any:
        """Value of a unit height at `since` after the middle of its rise over `width`."""
        z = since / width
        if not self.ramp:
            return 0.5 * (1 + ops.tanh(z))
        # 0.5 (z + log(2 cosh z)), written so that no exponential overflows
        size = ops.absolute(z)
        return 0.5 * width * (z + size + ops.log(1 + ops.exp(-2 * size)))
