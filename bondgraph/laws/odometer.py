"""A store that only counts: no effort, but a displacement for modulated elements to read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.laws.law import Law
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Odometer(Law):
    """No effort whatever the displacement: it neither stores nor takes energy.

    Examples
    --------
    >>> Odometer().n_memory
    0
    """

    name: ClassVar[str] = "odometer"
    energy: ClassVar[str] = "stores"

    @property
    def slope(self) -> float:
        """No stiffness."""
        return 0.0

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Nothing."""
        return 0.0 * s
