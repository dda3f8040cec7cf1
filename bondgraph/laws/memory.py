"""Laws with memory: a sum of stops (Maxwell slip) and any operator of `bondgraph.hysteresis`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.backend import CASADI, Ops
from bondgraph.elements import Parameter
from bondgraph.hysteresis import MaxwellResistiveCapacitor, Operator
from bondgraph.hysteresis.play import play
from bondgraph.laws.law import Law


@dataclass(frozen=True)
class StopSum(Law):
    """Prandtl-Ishlinskii law of stop type: ``sign * sum_i h_i (s - play_{r_i}[s])``.

    With ``h_i >= 0`` every stop is a spring with a slip: the law is passive (a Maxwell slip
    element in a storage). Thresholds are fixed, heights are parameters.

    Parameters
    ----------
    thresholds : tuple of float
        ``r_i > 0`` in units of `s`.
    height : float
        Start value of each ``h_i``, output units per unit of `s`.
    sign : float
        +1 in a storage; -1 where the output lags the argument (drive, sensor).
    """

    thresholds: tuple[float, ...] = (1.0,)
    height: float = 0.0
    scale: float = 1.0
    sign: float = 1.0
    unit: str = "1"
    name: ClassVar[str] = "prandtl_ishlinskii"
    energy: ClassVar[str] = "dissipates"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Return the heights ``h_i``."""
        return tuple(
            Parameter(f"h_{i}_{element}", self.height, self.unit, lower=0.0, scale=self.scale)
            for i in range(1, len(self.thresholds) + 1)
        )

    @property
    def n_memory(self) -> int:
        """One play state for each threshold."""
        return len(self.thresholds)

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Relaxed at `s`."""
        return (s,) * self.n_memory

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Relaxed memory follows `s`."""
        return (1.0,) * self.n_memory

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Each play moved to `s`."""
        return tuple(play(ops, s, r, y) for r, y in zip(self.thresholds, memory, strict=True))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Weighted stops at `s`."""
        total: Any = 0.0
        for h, y in zip(p, self.advance(ops, s, memory, p), strict=True):
            total = total + h * (s - y)
        return self.sign * total


@dataclass(frozen=True)
class Hysteretic(Law):
    """Any operator with memory as the whole law of an element, with numbers for its parameters."""

    operator: Operator
    name: ClassVar[str] = "operator"

    @property
    def energy(self) -> str:  # type: ignore[override]
        """Stops slip and dissipate; a sum of plays lags and, as a store, would give energy."""
        return "dissipates" if isinstance(self.operator, MaxwellResistiveCapacitor) else "signal"

    @property
    def slope(self) -> float:
        """The operator's reference slope."""
        return float(self.operator.linear_slope)

    @property
    def n_memory(self) -> int:
        """Memory of the operator."""
        return self.operator.n_memory

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Return the operator's own initial memory at `s`."""
        return tuple(float(v) for v in self.operator.initial_memory(s))

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Return the derivative of the operator's initial memory at `s`."""
        import casadi as ca

        x = ca.SX.sym("x")
        memory = ca.vertcat(*self.operator.initial_memory(x, ops=CASADI))
        slope = ca.Function("slope", [x], [ca.densify(ca.jacobian(memory, x))])
        return tuple(float(v) for v in slope(s).full().ravel())

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Memory of the operator at `s`."""
        return tuple(self.operator.advance(ops, s, tuple(memory)))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Operator less its reference slope."""
        return self.operator.value(ops, s, tuple(memory)) - self.slope * s
