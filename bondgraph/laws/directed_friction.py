"""Dry friction with a level for each direction: what asymmetric and graded friction share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.laws.friction import force_to_stop
from bondgraph.laws.law import Law
from bondgraph.support.ops import CASADI, Ops


@dataclass(frozen=True)
class DirectedFriction(Law, ABC):
    """``forwards`` while ``f > 0``, ``-backwards`` while ``f < 0``, anything between at rest.

    Abstract. The implicit step has the closed solution of `Coulomb`, with another level each way.
    """

    energy: ClassVar[str] = "dissipates"
    set_valued: ClassVar[bool] = True
    slides_level: ClassVar[bool] = True
    closed: ClassVar[bool] = True

    @abstractmethod
    def levels(self, ops: Ops, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, Any]:
        """Return both levels, at least 0."""

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Level of the direction, against the motion."""
        forwards, backwards = self.levels(ops, memory, p)
        way = ops.sign(s)
        return 0.5 * (forwards * (way * way + way) - backwards * (way * way - way))

    def solve(
        self, s_free: Any, gain: Any, memory: Sequence[Any], p: Sequence[Any], w_last: Any
    ) -> Any:
        """Friction that stops the motion if it can, else its level."""
        forwards, backwards = self.levels(CASADI, memory, p)
        return CASADI.maximum(-backwards, CASADI.minimum(forwards, force_to_stop(s_free, gain)))
