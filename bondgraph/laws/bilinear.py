"""A spring with two slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Bilinear(Law):
    """``dk max(q - knee, 0)``: slope ``k`` below the knee, ``k + dk`` above.

    The corner is sharp: two straight pieces need at most two Newton steps. Shaw and Holmes, A
    periodically forced piecewise linear oscillator, J. Sound and Vibration 90 (1983) 129.

    Parameters
    ----------
    change : float
        Start value of ``dk``.
    knee : float
        Start value of the knee.
    slope_size, size : float
        Typical stiffness and displacement; ``dk`` stays between -1.5 and 4 of the stiffness.

    Examples
    --------
    >>> law = Bilinear(500.0, 1e-3)
    >>> [p.name for p in law.parameters("k")]
    ['dk_k', 'knee_k']
    """

    change: float = 0.0
    knee: float = 0.0
    slope_size: float = 1.0
    size: float = 1.0
    unit: str = "m"
    slope_unit: str = "N/m"
    starts: ClassVar[tuple[str, ...]] = (
        "change", "knee", "slope_size", "size", "unit", "slope_unit",
    )  # fmt: skip
    name: ClassVar[str] = "bilinear"
    meanings: ClassVar[Mapping[str, str]] = {
        "dk": "change of the stiffness beyond the knee",
        "knee": "displacement at which the stiffness changes",
    }
    energy: ClassVar[str] = "stores"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Change of slope and knee."""
        k = self.slope_size
        return (
            Parameter(
                f"dk_{element}", self.change, self.slope_unit, positive=False,
                lower=-1.5 * k, upper=4.0 * k, scale=0.3 * k,
            ),
            Parameter(
                f"knee_{element}", self.knee, self.unit, positive=False, scale=0.1 * self.size
            ),
        )  # fmt: skip

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Additional effort above the knee."""
        return p[0] * ops.maximum(s - p[1], 0.0)
