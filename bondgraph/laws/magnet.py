"""Force of a magnet: with the inverse square of the distance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonZero, Positive
from bondgraph.support.ops import Ops

CLOSEST = 0.05
"""Part of the distance at rest below which the force grows no more: no magnet is a point."""


@dataclass(frozen=True)
class Magnet(Law):
    """``F_g (g / (s + g))^2``; stores, for it is a function of the displacement alone.

    Two magnets' poles by Coulomb's law 1785, or an armature before a yoke (``B^2 A / 2 mu_0`` with
    a field over the gap: Woodson and Melcher, Electromechanical Dynamics, 1968, chapter 3).

    Parameters
    ----------
    force : float
        Start value of ``F_g``, the effort at no displacement; either sign.
    gap : float
        Start value of ``g``, the distance at no displacement; negative if the magnet stands on the
        side of positive displacement. ``force=a, gap=1`` with a displacement that counts from one
        is ``a / x^2``.
    closest : float
        The fit keeps ``|g|`` above this, or above where it starts if that is less.
    free_standing : bool
        The whole force. Otherwise what it has beside its value and slope at no displacement: those
        belong to the place where a spring rests, and to the spring.

    Examples
    --------
    >>> law = Magnet(1.0, 2e-3, 5e-4)
    >>> [p.name for p in law.parameters("k")]
    ['F_g_k', 'gap_k']
    """

    force: float = 1.0
    gap: NonZero = 1.0
    closest: Positive = 0.1
    size: Positive = 1.0
    free_standing: bool = True
    unit: str = "N"
    way_unit: str = "m"
    starts: ClassVar[tuple[str, ...]] = ("force", "gap", "closest", "size", "unit", "way_unit")
    name: ClassVar[str] = "magnet"
    meanings: ClassVar[Mapping[str, str]] = {
        "F_g": "force at no displacement",
        "gap": "distance at no displacement",
    }
    energy: ClassVar[str] = "stores"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Force and distance at no displacement."""
        near, far = min(self.closest, abs(self.gap)), 20.0 * abs(self.gap)
        low, high = (near, far) if self.gap > 0 else (-far, -near)
        return (
            Parameter(f"F_g_{element}", self.force, self.unit, positive=False, scale=self.size),
            Parameter(
                f"gap_{element}", self.gap, self.way_unit, positive=False, lower=low, upper=high,
                scale=0.1 * abs(self.gap),
            ),
        )  # fmt: skip

    @property
    def slope(self) -> float | None:
        """No spring where it stands alone."""
        return 0.0 if self.free_standing else None

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return the force at the displacement `s`."""
        u = ops.maximum(s / p[1], CLOSEST - 1.0)
        rest = 0.0 if self.free_standing else 1.0 - 2.0 * u
        return p[0] * ((1.0 + u) ** -2 - rest)
