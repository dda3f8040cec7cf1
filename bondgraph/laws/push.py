"""A disturbance that sets in and ends: a push in time that the motion does not touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.stepwise import Stepwise
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Push(Stepwise):
    """A step of height ``h`` at ``t_0`` that is taken back at ``t_1``, whatever `s` is.

    Parameters as of `Stepwise`, and:

    Parameters
    ----------
    end : float
        Start value of ``t_1``, s from the start of the run.

    Examples
    --------
    >>> law = Push(1.2, 0.01, end=1.5)
    >>> [p.name for p in law.parameters("d")]
    ['h_d', 't_0_d', 't_1_d', 'rise_d']
    """

    end: float = 2.0
    starts: ClassVar[tuple[str, ...]] = (*Stepwise.starts, "end")
    name: ClassVar[str] = "push"
    meanings: ClassVar[Mapping[str, str]] = {
        "h": "height of the push",
        "t_0": "moment at which it begins",
        "t_1": "moment at which it ends",
        "rise": "time that its edges take",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Height, begin, end, rise time."""
        begin, end = (
            self.moment(f"t_0_{element}", self.time),
            self.moment(f"t_1_{element}", self.end),
        )
        return self.height(element), begin, end, self.rise(element)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Value at the end of the step."""
        height, begin, end, width, step = p
        now = memory[0] + step
        return height * (
            self.switched(ops, now - begin, width) - self.switched(ops, now - end, width)
        )
