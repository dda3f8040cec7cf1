"""Torque of a weight on an arm: with the sine of the angle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.laws.trigonometry import sine
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Gravity(Law):
    """``T_g sin(angle)``, ``T_g = m g l``; stores, for it is a function of the angle alone.

    Huygens, Horologium oscillatorium, 1673: a pendulum swings the slower the wider it swings.

    Parameters
    ----------
    torque : float
        Start value of ``T_g``, the torque of the arm when it is level.
    free_standing : bool
        The whole torque. Otherwise what it has beside its slope where it hangs, which belongs to
        the stiffness of the element: beside ``m g l`` of that the sum is ``m g l sin(angle)``.

    Examples
    --------
    >>> law = Gravity(2.0)
    >>> [p.name for p in law.parameters("k")]
    ['T_g_k']
    """

    torque: float = 1.0
    size: Positive = 1.0
    free_standing: bool = True
    unit: str = "N*m"
    starts: ClassVar[tuple[str, ...]] = ("torque", "size", "unit")
    name: ClassVar[str] = "gravity"
    meanings: ClassVar[Mapping[str, str]] = {"T_g": "torque of the weight where its arm is level"}
    energy: ClassVar[str] = "stores"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Return the torque of the level arm."""
        return (
            Parameter(f"T_g_{element}", self.torque, self.unit, positive=False, scale=self.size),
        )

    @property
    def slope(self) -> float | None:
        """No spring where it stands alone."""
        return 0.0 if self.free_standing else None

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return the torque at the angle `s`, rad."""
        return p[0] * (sine(ops, s) - (0.0 if self.free_standing else s))
