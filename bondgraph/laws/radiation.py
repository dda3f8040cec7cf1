"""A path for heat that radiates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import Ops

COLDEST = 1e-3
"""Least of ``(1 + e/T)^4``: nothing radiates less than a body near 0 K."""


@dataclass(frozen=True)
class Radiation(Law):
    """``share T ((1 + 4 v)^(1/4) - 1 - v)`` beside ``R f``, with ``v = R f / T``.

    The temperature difference over a surface that radiates ``f = b ((T + e)^4 - T^4)`` is
    ``T ((1 + 4 v)^(1/4) - 1)`` with ``R = 1 / (4 b T^3)``, its resistance at small differences
    (Stefan 1879, Boltzmann 1884; ``b`` is emissivity times area times 5.67e-8 W/(m2 K4)). It makes
    a `share` of the element's resistance ``R``; the rest conducts, behind it. For a share that
    radiates beside what conducts the law holds to second order in ``e / T``. Passive with its
    resistor up to a share of 1; alone it promises nothing.

    Parameters
    ----------
    share : float
        Start value; above 1 the path bends more than radiation can.
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
        "R_own": "resistance at small differences",
        "radiates": "part of the resistance that radiates",
        "T": "absolute temperature of the surroundings",
    }
    energy: ClassVar[str] = "signal"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Resistance, share of the radiation, then the fixed absolute temperature."""
        own = self.coefficient or f"R_own_{element}"
        return (
            Parameter(own, self.resistance, self.unit, scale=self.resistance),
            Parameter(
                f"radiates_{element}", self.share, "1", positive=False, lower=0.0, upper=4.0,
                scale=0.1,
            ),
            Parameter(f"T_{element}", self.surroundings, "K", fixed=True),
        )  # fmt: skip

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return what the path needs less than the straight line."""
        return p[1] * p[2] * bent(ops, p[0] * s / p[2])


def bent(ops: Ops, v: Any) -> Any:
    """Return ``(1 + 4 v)^(1/4) - 1 - v``: how a black surface departs from its tangent."""
    return ops.sqrt(ops.sqrt(ops.maximum(1.0 + 4.0 * v, COLDEST))) - 1.0 - v
