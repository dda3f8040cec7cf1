"""Smooth departure from proportionality: quadratic and cubic terms about a centre."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonZero, whole
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Polynomial(Law):
    """``a_2 z^2 + a_3 z^3 + ...`` with ``z = (s - centre) / half``; `a` in output units.

    The scaled argument keeps the coefficients comparable: ``a_j`` is what the term adds at the
    edge of the range. As a storage law it derives from the energy ``integral e dq`` and so stores.

    Parameters
    ----------
    from_rest : bool
        Nothing is added where the argument is zero, however far the centre is: no constant effort.

    Examples
    --------
    >>> law = Polynomial(half=2e-3, orders=(3,))
    >>> [p.name for p in law.parameters("k")]
    ['a_3_k']
    """

    centre: float = 0.0
    half: NonZero = 1.0
    size: float = 1.0
    orders: tuple[Annotated[int, whole(0, 64)], ...] = (2, 3)
    unit: str = "1"
    from_rest: bool = False
    starts: ClassVar[tuple[str, ...]] = ("size", "unit")
    name: ClassVar[str] = "polynomial"
    meanings: ClassVar[Mapping[str, str]] = {
        "a_i": "what this term adds at the end of the range, where (argument - centre)/half is 1; "
        "about the centre, not about zero",
        "centre_i": "middle of the range",
        "half_i": "half of the range",
    }
    energy: ClassVar[str] = "stores"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """One coefficient for each order."""
        return tuple(
            Parameter(f"a_{j}_{element}", 0.0, self.unit, positive=False, scale=self.size)
            for j in self.orders
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Sum of the powers."""
        z = (s - self.centre) / self.half
        rest = -self.centre / self.half
        total: Any = 0.0
        for j, a in zip(self.orders, p, strict=True):
            total = total + a * (z**j - rest**j if self.from_rest else z**j)
        return total
