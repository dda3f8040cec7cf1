"""Friction and drag in a resistor: deviations from ``e = R f``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.iteration import Iteration
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import Ops


def force_to_stop(s_free: Any, gain: Any) -> Any:
    """Friction that would stop the motion within the step; without a step, its direction."""
    import casadi as ca  # late: most of the time to import bondgraph

    moving = gain < 0
    return ca.if_else(moving, -s_free / ca.if_else(moving, gain, -1.0), 1e30 * ca.sign(s_free))


@dataclass(frozen=True)
class Coulomb(Law):
    """Dry friction ``F_c sign(f)``; sticks exactly, without a regularising velocity.

    The implicit step ``f = f_free + gain * F`` with a set-valued sign has the closed solution
    ``f = shrink(f_free, |gain| F_c)`` (Moreau, Unilateral contact and dry friction, 1988).

    Examples
    --------
    >>> law = Coulomb(0.8)
    >>> [p.name for p in law.parameters("d")]
    ['F_c_d']
    """

    force: NonNegative = 1.0
    unit: str = "N"
    starts: ClassVar[tuple[str, ...]] = ("force", "unit")
    name: ClassVar[str] = "coulomb"
    meanings: ClassVar[Mapping[str, str]] = {
        "F_c": "friction level, the same at every speed",
    }
    energy: ClassVar[str] = "dissipates"
    set_valued: ClassVar[bool] = True
    slides_level: ClassVar[bool] = True
    closed: ClassVar[bool] = True

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Friction level ``F_c``."""
        return (Parameter(f"F_c_{element}", self.force, self.unit, lower=0.0, scale=self.force),)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """``F_c sign(f)``."""
        return p[0] * ops.sign(s)

    def solve(
        self, s_free: Any, gain: Any, memory: Sequence[Any], p: Sequence[Any], w_last: Any
    ) -> Any:
        """Friction that stops the motion if it can, else its level."""
        import casadi as ca

        stopping = force_to_stop(s_free, gain)
        return ca.fmax(-p[0], ca.fmin(p[0], stopping))


@dataclass(frozen=True)
class Stribeck(Law):
    """Dry friction that falls with speed: ``(F_c + F_d exp(-(f/f_s)^2)) sign(f)``.

    Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083.

    Examples
    --------
    >>> law = Stribeck(0.8, 0.4, 0.01)
    >>> [p.name for p in law.parameters("d")]
    ['F_c_d', 'F_d_d', 'f_s_d']
    """

    force: NonNegative = 1.0
    drop: NonNegative = 0.5
    speed: Positive = 1e-2
    unit: str = "N"
    flow_unit: str = "m/s"
    starts: ClassVar[tuple[str, ...]] = ("force", "drop", "speed", "unit", "flow_unit")
    name: ClassVar[str] = "stribeck"
    meanings: ClassVar[Mapping[str, str]] = {
        "F_c": "friction level at high speed",
        "F_d": "by how much the level at rest is higher",
        "f_s": "speed over which the level falls to that",
    }
    energy: ClassVar[str] = "dissipates"
    set_valued: ClassVar[bool] = True
    closed: ClassVar[bool] = True

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``F_c``, ``F_d`` (static level less ``F_c``) and ``f_s``."""
        return (
            Parameter(f"F_c_{element}", self.force, self.unit, lower=0.0, scale=self.force),
            Parameter(f"F_d_{element}", self.drop, self.unit, lower=0.0, scale=self.force),
            Parameter(
                f"f_s_{element}",
                self.speed,
                self.flow_unit,
                lower=0.1 * self.speed,
                upper=10.0 * self.speed,
                scale=self.speed,
            ),
        )

    def _level(self, ops: Ops, s: Any, p: Sequence[Any]) -> Any:
        return p[0] + p[1] * ops.exp(-((s / p[2]) ** 2))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Level at this speed, against the motion."""
        return self._level(ops, s, p) * ops.sign(s)

    def solve(
        self, s_free: Any, gain: Any, memory: Sequence[Any], p: Sequence[Any], w_last: Any
    ) -> Any:
        """Shrink with the level of the speed that the last pass found."""
        import casadi as ca

        from bondgraph.support.ops import CASADI

        stopping = force_to_stop(s_free, gain)
        speed = s_free + gain * w_last
        w = w_last
        for _ in range(6):
            level = self._level(CASADI, speed, p)
            w = ca.fmax(-level, ca.fmin(level, stopping))
            speed = s_free + gain * w
        return w


@dataclass(frozen=True)
class Viscous(Law):
    """Linear friction ``b_2 f`` on top of the resistor's own value: a part that may be left out.

    Examples
    --------
    >>> law = Viscous(0.6)
    >>> [p.name for p in law.parameters("d")]
    ['b_2_d']
    """

    coefficient: NonNegative = 1.0
    unit: str = "N*s/m"
    starts: ClassVar[tuple[str, ...]] = ("coefficient", "unit")
    name: ClassVar[str] = "viscous"
    meanings: ClassVar[Mapping[str, str]] = {
        "b_2": "friction for each unit of speed",
    }
    energy: ClassVar[str] = "dissipates"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Return the coefficient."""
        return (
            Parameter(
                f"b_2_{element}", self.coefficient, self.unit, lower=0.0, scale=self.coefficient
            ),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """``b_2 f``."""
        return p[0] * s


@dataclass(frozen=True)
class QuadraticDrag(Law):
    """Turbulent drag ``c |f| f``.

    Examples
    --------
    >>> law = QuadraticDrag(0.7)
    >>> [p.name for p in law.parameters("d")]
    ['c_2_d']
    """

    coefficient: NonNegative = 1.0
    unit: str = "N*s2/m2"
    starts: ClassVar[tuple[str, ...]] = ("coefficient", "unit")
    name: ClassVar[str] = "quadratic_drag"
    meanings: ClassVar[Mapping[str, str]] = {
        "c_2": "effort for each square of the flow",
    }
    energy: ClassVar[str] = "dissipates"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Return the drag coefficient."""
        return (
            Parameter(
                f"c_2_{element}", self.coefficient, self.unit, lower=0.0, scale=self.coefficient
            ),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """``c |f| f``."""
        return p[0] * ops.absolute(s) * s

    def iteration(self, memory: Sequence[Any], p: Sequence[Any]) -> Iteration:
        """Begin at the root: from a flow far off a Newton step only halves it each time."""
        return replace(
            super().iteration(memory, p),
            begin=lambda free, gain, w_last: square_drag_flow(free, gain, p[0]),
        )


def square_drag_flow(free: Any, gain: Any, k: Any) -> Any:
    """Return the flow ``f = free + gain k f |f|``, without a difference of two large numbers.

    CasADi in and out; a drag takes flow away, so that `gain` is negative.
    """
    import casadi as ca

    return 2.0 * free / (1.0 + ca.sqrt(ca.fmax(1.0 - 4.0 * gain * k * ca.fabs(free), 0.0)))
