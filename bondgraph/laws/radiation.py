"""A path for heat that radiates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import SYMPY, Ops

COLDEST = 0.1
"""Least of ``1 + e/T``: nothing radiates less than a body near 0 K."""
NEWTON_STEPS = 4
SMALL = 1e-9


@dataclass(frozen=True)
class Radiation(Law):
    """Heat ``((1 - radiates) e + radiates T/4 ((1 + e/T)^4 - 1)) / R`` over a difference ``e``.

    A surface radiates ``b ((T + e)^4 - T^4)`` to surroundings at ``T`` (Stefan 1879, Boltzmann
    1884; ``b`` is emissivity times area times 5.67e-8 W/(m2 K4)), and beside it heat is conducted
    in proportion. ``R`` is the resistance of both at small differences, so
    ``b = radiates / (4 R T^3)``, and the rest is conducted over ``R / (1 - radiates)``. Passive
    with its resistor; alone it promises nothing.

    Parameters
    ----------
    share : float
        Start value of the part that radiates, 0 to 1.
    surroundings : float
        Absolute temperature ``T`` of the end that the difference counts from, K, a fixed parameter.
    coefficient : str
        Name of the parameter that is the element's resistance; "" for an own one.
    resistance : float
        Its start value where it is the law's own.

    Examples
    --------
    >>> law = Radiation(1.0, 293.15, "r")
    >>> [p.name for p in law.parameters("r")]
    ['r', 'radiates_r', 'T_r']
    """

    share: NonNegative = 1.0
    surroundings: Positive = 293.15
    coefficient: str = ""
    resistance: Positive = 1.0
    unit: str = "K/W"
    starts: ClassVar[tuple[str, ...]] = (
        "share", "surroundings", "coefficient", "resistance", "unit",
    )  # fmt: skip
    name: ClassVar[str] = "radiation"
    meanings: ClassVar[Mapping[str, str]] = {
        "R_own": "resistance of both at small differences",
        "radiates": "part of the flow that radiates, at small differences; the rest conducts",
        "T": "absolute temperature of the surroundings",
    }
    energy: ClassVar[str] = "signal"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Resistance, share of the radiation, then the fixed absolute temperature."""
        own = self.coefficient or f"R_own_{element}"
        return (
            Parameter(own, self.resistance, self.unit, scale=self.resistance),
            Parameter(
                f"radiates_{element}", self.share, "1", positive=False, lower=0.0, upper=1.0,
                scale=0.1,
            ),
            Parameter(f"T_{element}", self.surroundings, "K", fixed=True),
        )  # fmt: skip

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return what the path needs less than the straight line."""
        resistance, share, t = p
        straight = resistance * s / t
        least = (1.0 - share) * (COLDEST - 1.0) + 0.25 * share * (COLDEST**4 - 1.0)
        if ops is SYMPY:  # unrolled, the steps are no formula that anybody could differentiate
            from bondgraph.laws.radiating_level import radiating_level

            return t * (radiating_level(straight, share) - straight)
        w = ops.maximum(straight, least)
        # rising and convex: Newton's steps come down from above, where one of two guesses is near
        alone = ops.sqrt(ops.sqrt(1.0 + 4.0 * ops.maximum(w, 0.0) / ops.maximum(share, SMALL)))
        v = ops.minimum(w + share * bent(ops, w), alone - 1.0)
        for _ in range(NEWTON_STEPS):
            y = 1.0 + v
            flow = (1.0 - share) * v + 0.25 * share * (y**4 - 1.0)
            v = v - (flow - w) / (1.0 - share + share * y**3)
        return t * (v - straight)


def bent(ops: Ops, v: Any) -> Any:
    """Return ``(1 + 4 v)^(1/4) - 1 - v``: how a black surface departs from its tangent."""
    return ops.sqrt(ops.sqrt(ops.maximum(1.0 + 4.0 * v, COLDEST**4))) - 1.0 - v
