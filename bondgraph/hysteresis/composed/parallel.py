"""Two operators side by side.

Sizes: the memory is the one of the first operator followed by the one of the second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, final

from bondgraph.hysteresis.composed.pair import FirstAndSecond, SideBySide
from bondgraph.hysteresis.operator import Memory
from bondgraph.support.ops import Expression, Ops


@final
@dataclass(frozen=True, slots=True)
class Parallel(FirstAndSecond, SideBySide):
    """Two operators side by side, ``y = first[x] + second[x]``; nest it for more.

    There is no exact inverse in general: use `numeric_inverse`, or `HysteresisWithCreep`.

    Parameters
    ----------
    first, second : Operator
        Both see the input; their outputs have one unit.

    Raises
    ------
    BadParameter
        If one of them is no operator.

    Examples
    --------
    >>> from bondgraph.hysteresis.plays.dead_zone import DeadZones
    >>> from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
    >>> plays, zones = PrandtlIshlinskii((0, 1), (1, 1)), DeadZones((0, 2), (1, 0.5))
    >>> Parallel(plays, zones).run([0.0, 3.0, 2.0])[0].tolist()
    [0.0, 8.5, 6.0]
    """

    kind: ClassVar[str] = "parallel"

    @property
    def wipes_out(self) -> bool:
        """Whether both do."""
        return self.first.wipes_out and self.second.wipes_out

    @property
    def congruent(self) -> bool:
        """Whether both are."""
        return self.first.congruent and self.second.congruent

    @property
    def linear_slope(self) -> Expression:
        """Sum of the two slopes."""
        return self.first.linear_slope + self.second.linear_slope

    @property
    def passive_port(self) -> Literal["input", "output"] | None:
        """The port at which both are passive, if it is the same."""
        port = self.first.passive_port
        return port if port == self.second.passive_port else None

    def _energy(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, Expression] | None:
        one, two = self._split(memory)
        found = (self.first._energy(ops, x, one, step), self.second._energy(ops, x, two, step))
        if found[0] is None or found[1] is None:
            return None
        return found[0][0] + found[1][0], found[0][1] + found[1][1]
