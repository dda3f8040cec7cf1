"""LuGre friction: bristles that bend before the contact slides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.bracketing import bracketed
from bondgraph.laws.iteration import Iteration
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import CASADI, Ops


@dataclass(frozen=True)
class LuGre(Law):
    """Presliding and Stribeck friction with one bristle state ``z``, for a resistor.

    ``z' = v - sigma_0 |v| z / g(v)``, ``F = sigma_0 z + sigma_1 z'``,
    ``g(v) = F_c + F_d exp(-(v/v_s)^2)``; the resistor's own value is sigma_2. Within a step ``v``
    is held at its end value and ``z`` follows its exact exponential, so that no step is too long
    for the bristle.

    Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419. Passive
    for every motion only while ``sigma_1 <= 4 sigma_0 F_c / |v| (F_c / F_d)^2``-like bounds hold;
    with ``sigma_1 = 0`` it never returns more than the bristle took.

    Parameters
    ----------
    force, drop, speed : float
        Start values of F_c, F_d (static level less F_c) and v_s.
    bristle : float
        Start value of sigma_0, force per displacement.
    damping : float
        Start value of sigma_1, force per flow.

    Examples
    --------
    >>> law = LuGre(0.8, 0.4, 0.01, 1e5)
    >>> [p.name for p in law.parameters("d")]
    ['F_c_d', 'F_d_d', 'v_s_d', 'sigma_0_d', 'sigma_1_d']
    """

    force: NonNegative = 1.0
    drop: NonNegative = 0.5
    speed: Positive = 1e-2
    bristle: Positive = 1e5
    damping: NonNegative = 0.0
    unit: str = "N"
    flow_unit: str = "m/s"
    starts: ClassVar[tuple[str, ...]] = (
        "force", "drop", "speed", "bristle", "damping", "unit", "flow_unit",
    )  # fmt: skip
    name: ClassVar[str] = "lugre"
    meanings: ClassVar[Mapping[str, str]] = {
        "F_c": "friction level at high speed",
        "F_d": "by how much the level near rest is higher",
        "v_s": "speed over which the level falls",
        "sigma_0": "stiffness of the contact before it slides",
        "sigma_1": "damping of the contact before it slides",
    }
    energy: ClassVar[str] = "dissipates"
    lives_in_time: ClassVar[bool] = True
    """The bristle bends in time."""
    flows: ClassVar[bool] = True
    follows: ClassVar[tuple[bool, ...]] = (False,)
    """Deflection of the bristle."""

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``F_c``, ``F_d``, ``v_s``, ``sigma_0`` and ``sigma_1``."""
        v, b = self.speed, self.bristle
        stiffness, damping = f"{self.unit}/m", f"{self.unit}*s/m"
        extra = max(self.damping, 1e-3 * self.force / v)
        return (
            Parameter(
                f"F_c_{element}", self.force, self.unit, lower=1e-3 * self.force, scale=self.force
            ),
            Parameter(f"F_d_{element}", self.drop, self.unit, lower=0.0, scale=self.force),
            Parameter(f"v_s_{element}", v, self.flow_unit, lower=0.1 * v, upper=10.0 * v, scale=v),
            Parameter(f"sigma_0_{element}", b, stiffness, lower=0.01 * b, scale=b),
            Parameter(f"sigma_1_{element}", self.damping, damping, lower=0.0, scale=extra),
        )

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Deflection after the step, from the exact exponential."""
        h = p[-1]
        x = self._rate(ops, s, p) * h
        small = x < 1e-6
        safe = ops.where(small, 1.0, x)
        share = ops.where(small, 1.0 - 0.5 * x, (1.0 - ops.exp(-safe)) / safe)
        return (memory[0] * ops.exp(-x) + s * h * share,)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Force of the bristle at the end of the step."""
        (z,) = self.advance(ops, s, memory, p)
        return p[3] * z + p[4] * (s - self._rate(ops, s, p) * z)

    def _rate(self, ops: Ops, s: Any, p: Sequence[Any]) -> Any:
        level = p[0] + p[1] * ops.exp(-((s / p[2]) ** 2))
        return p[3] * ops.absolute(s) / level

    def iteration(self, memory: Sequence[Any], p: Sequence[Any]) -> Iteration:
        """Search between the free flow and the flow that the largest force would leave."""
        largest = CASADI.maximum(p[3] * CASADI.absolute(memory[0]), p[0] + p[1])
        return bracketed(self, memory, p, largest)
