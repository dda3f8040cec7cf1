"""Contact with a loss of its own at the end of a stroke."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, final

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.end_stop import EndStop
from bondgraph.laws.growing_damping import SHORTEST
from bondgraph.laws.iteration import Iteration
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import Ops

STEPS = 16
"""Of Newton's that are always enough."""


@final
@dataclass(frozen=True)
class HuntCrossley(EndStop):
    """``k_s d (1 + loss dd/dt)`` at a depth `d` in the stop: restitution below 1.

    Hunt and Crossley, J. Applied Mechanics 42 (1975) 440, with a linear spring. What is lost over a
    step is the exact mean along the way, so that no step gives energy back.

    Parameters
    ----------
    loss : float
        Start value of the damping over the stiffness for each unit of depth, s over way.
    slowness : float
        Typical size of that.

    Examples
    --------
    >>> law = HuntCrossley(5e4, high=2e-3, sides="high", loss=0.5)
    >>> [p.name for p in law.parameters("k")]
    ['k_s_k', 'high_k', 'loss_k']
    """

    loss: NonNegative = 0.0
    slowness: Positive = 1.0
    loss_unit: str = "s/m"
    starts: ClassVar[tuple[str, ...]] = (*EndStop.starts, "loss", "slowness", "loss_unit")
    name: ClassVar[str] = "hunt_crossley"
    meanings: ClassVar[Mapping[str, str]] = {
        **EndStop.meanings,
        "loss": "part of the contact's force that a unit of speed adds",
    }
    energy: ClassVar[str] = "dissipates"
    lives_in_time: ClassVar[bool] = True
    """The rate is the way of a step over its time."""
    follows: ClassVar[tuple[bool, ...]] = (True,)
    """The displacement one step ago."""

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Those of the stop, then the loss."""
        lossy = Parameter(
            f"loss_{element}", self.loss, self.loss_unit, lower=0.0, scale=self.slowness
        )
        return (*super().parameters(element), lossy)

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Displacement after the step."""
        return (s,)

    def iteration(self, memory: Sequence[Any], p: Sequence[Any]) -> Iteration:
        """Return Newton's way, longer: from far inside a square each step goes half of the rest."""
        return replace(super().iteration(memory, p), most=STEPS)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Contact effort and its loss over the step."""
        *stop, loss, step = p
        elastic = super().deviation(ops, s, memory, stop)
        lost: Any = 0.0
        if self.sides != "low":
            lost = ops.maximum(s - stop[-1], 0.0) ** 2 - ops.maximum(memory[0] - stop[-1], 0.0) ** 2
        if self.sides != "high":
            now, before = (ops.maximum(stop[1] - at, 0.0) ** 2 for at in (s, memory[0]))
            lost = lost + before - now
        return elastic + stop[0] * loss * lost / (2.0 * ops.maximum(step, SHORTEST))
