"""Laws of time: their memory is the time since the start."""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from typing import Any, ClassVar

from bondgraph.laws.law import Law
from bondgraph.support.ops import Ops


class Clocked(Law, ABC):
    """A law that depends on the time since the start; abstract."""

    counts_time: ClassVar[bool] = True
    lives_in_time: ClassVar[bool] = True
    """Time matters."""
    flows: ClassVar[bool] = True
    follows: ClassVar[tuple[bool, ...]] = (False,)
    """Time since the start, s."""

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Time goes on."""
        return (memory[0] + p[-1],)
