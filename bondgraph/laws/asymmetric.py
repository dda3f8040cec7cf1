"""Damping and dry friction that differ between the two directions of motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.directed_friction import DirectedFriction
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class AsymmetricDamping(Law):
    """``d |f|`` beside ``R f``: the resistance is ``R + d`` forwards and ``R - d`` backwards.

    The two coefficients of a vehicle damper in rebound and compression (Dixon, The Shock Absorber
    Handbook, 2007), written as their mean and half their difference. Alone it gives energy back in
    one direction; with the resistor's own value it is passive while ``|d| <= R``.

    Parameters
    ----------
    difference : float
        Start value of ``d``, units of the resistance.
    size : float
        Typical resistance.

    Examples
    --------
    >>> law = AsymmetricDamping(1.5)
    >>> [p.name for p in law.parameters("d")]
    ['d_a_d']
    """

    difference: float = 0.0
    size: Positive = 1.0
    unit: str = "N*s/m"
    starts: ClassVar[tuple[str, ...]] = ("difference", "size", "unit")
    name: ClassVar[str] = "asymmetric_damping"
    meanings: ClassVar[Mapping[str, str]] = {
        "d_a": "half the difference of the resistance forwards and backwards",
    }
    energy: ClassVar[str] = "signal"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Half the difference of the two resistances."""
        return (
            Parameter(
                f"d_a_{element}", self.difference, self.unit, positive=False, scale=self.size
            ),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """``d |f|``."""
        return p[0] * ops.absolute(s)


@dataclass(frozen=True)
class AsymmetricCoulomb(DirectedFriction):
    """Dry friction of level ``F_1`` forwards and ``F_2`` backwards.

    As an effort it is, at rest too, ``(F_1 + F_2) / 2`` of Coulomb friction and a constant force
    ``(F_1 - F_2) / 2``: without a sensor that tells where no force acts the two look the same.

    Parameters
    ----------
    force, back : float
        Start values of ``F_1`` and ``F_2``.

    Examples
    --------
    >>> law = AsymmetricCoulomb(0.8, 0.5)
    >>> [p.name for p in law.parameters("d")]
    ['F_1_d', 'F_2_d']
    """

    force: NonNegative = 1.0
    back: NonNegative = 1.0
    unit: str = "N"
    starts: ClassVar[tuple[str, ...]] = ("force", "back", "unit")
    name: ClassVar[str] = "asymmetric_coulomb"
    meanings: ClassVar[Mapping[str, str]] = {
        "F_1": "friction level forwards",
        "F_2": "friction level backwards",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``F_1`` and ``F_2``."""
        size = max(self.force, self.back) or 1.0
        return tuple(
            Parameter(f"F_{i}_{element}", level, self.unit, lower=0.0, scale=size)
            for i, level in ((1, self.force), (2, self.back))
        )

    def levels(self, ops: Ops, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, Any]:
        """Return the two levels."""
        return p[0], p[1]
