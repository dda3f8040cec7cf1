"""A slope that follows a course in time: it jumps at one moment, or swings."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.clocked import Clocked
from bondgraph.support.bounds import Bound
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class TimedSlope(Clocked):
    """``s c(t)``, the course ``c`` another law's value in time.

    Parameters
    ----------
    course : Clocked
        A tone or an onset that stands beside a slope; its unit is that of the slope.

    Examples
    --------
    >>> from bondgraph.laws import Onset
    >>> law = TimedSlope(Onset(1.2, free_standing=False))
    >>> [p.name for p in law.parameters("k")]
    ['h_k', 't_0_k', 'rise_k']
    """

    course: Annotated[
        Clocked,
        Bound(
            "a law of time that stands beside a slope of its element",
            lambda v: isinstance(v, Clocked) and v.slope is None and v.name != "timed_slope",
        ),
    ]
    name: ClassVar[str] = "timed_slope"

    @property
    def structure(self) -> Hashable:
        """Without the start values of the course."""
        return TimedSlope, self.course.structure

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Those of the course."""
        return self.course.parameters(element)

    def meaning(self, name: str) -> str:
        """As the course."""
        return self.course.meaning(name)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Change of the slope at the end of the step, times `s`."""
        return s * self.course.deviation(ops, 0.0, memory, p)
