"""A disturbance that sets in: a step or a ramp in time that the motion does not touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.stepwise import Stepwise
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Onset(Stepwise):
    """``h (1 + tanh((t - t_0) / width)) / 2``, whatever `s` is.

    Parameters as of `Stepwise`.

    Examples
    --------
    >>> law = Onset(1.2, 0.01)
    >>> [p.name for p in law.parameters("d")]
    ['h_d', 't_0_d', 'rise_d']
    """

    name: ClassVar[str] = "onset"
    meanings: ClassVar[Mapping[str, str]] = {
        "h": "height of the step",
        "t_0": "moment of the step",
        "rise": "time that the step takes",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Height, time, rise time."""
        return self.height(element), self.moment(f"t_0_{element}", self.time), self.rise(element)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Value at the end of the step."""
        height, begin, width, step = p
        return height * self.switched(ops, memory[0] + step - begin, width)
