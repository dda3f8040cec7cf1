"""Any operator of `bondgraph.hysteresis` as the law of an element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.backend import CASADI, Ops
from bondgraph.hysteresis import Operator
from bondgraph.laws.law import Law


@dataclass(frozen=True)
class Hysteretic(Law):
    """Any operator with memory as the whole law of an element, with numbers for its parameters.

    In a storage the argument is the displacement and the output the effort; in a resistor flow and
    effort; in a drive or a sensor the signal before and after.
    """

    operator: Operator
    name: ClassVar[str] = "operator"

    @property
    def energy(self) -> str:  # type: ignore[override]
        """``dissipates`` if the operator is passive with its output as effort, else ``signal``.

        A sum of plays lags and, as a store, would give energy: use its inverse there.
        """
        return "dissipates" if self.operator.passive_port == "output" else "signal"

    @property
    def timed(self) -> bool:
        """Of the operator."""
        return self.operator.timed

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
        return initial_slope(self.operator, s)

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Memory of the operator at `s`."""
        return tuple(self.operator.advance(ops, s, tuple(memory), *p))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Operator less its reference slope."""
        return self.operator.value(ops, s, tuple(memory), *p) - self.slope * s


def initial_slope(operator: Operator, s: float) -> tuple[float, ...]:
    """Return the derivative of a virgin memory by the first input, shape (n_memory,)."""
    import casadi as ca

    if not operator.n_memory:
        return ()
    x = ca.SX.sym("x")
    memory = ca.vertcat(*operator.initial_memory(x, ops=CASADI))
    slope = ca.Function("slope", [x], [ca.densify(ca.jacobian(memory, x))])
    return tuple(float(v) for v in slope(s).full().ravel())
