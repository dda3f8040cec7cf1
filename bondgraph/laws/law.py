"""What every constitutive law is: a linear slope plus a deviation, with explicit memory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from bondgraph.backend import Ops

if TYPE_CHECKING:
    from bondgraph.elements import Parameter

NEWTON_STEPS = 6


@dataclass(frozen=True)
class Law(ABC):
    """A scalar law ``output = slope * s + deviation(s, memory; p)``; abstract.

    `s` is the displacement for a storage, the flow for a resistor, the command for a drive and
    the true value for a sensor. Keeping the linear slope apart lets the integrator treat the
    stiff linear part exactly; only the deviation is interpolated.

    `energy` is the claim the contract test checks: ``stores`` (a function of `s` alone in a
    storage), ``dissipates`` (never returns more than it took) or ``signal`` (no power port).
    """

    name: ClassVar[str] = ""
    energy: ClassVar[str] = "signal"
    set_valued: ClassVar[bool] = False
    """The deviation jumps and is held at its end value over a step: a line would ring."""
    closed: ClassVar[bool] = False
    """`solve` is a formula to be differentiated; otherwise the deviation has a slope at the root
    and the implicit function theorem gives the derivatives."""

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Parameters of the deviation, named after `element`."""
        return ()

    @property
    def slope(self) -> float | None:
        """Own linear slope, or None when the element's value is the slope."""
        return None

    @property
    def timed(self) -> bool:
        """Whether time matters; then `p` ends with the time since the memory, s."""
        return False

    @property
    def n_memory(self) -> int:
        """How many numbers the memory holds."""
        return 0

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Memory of a law at rest at `s`."""
        return ()

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Return the derivative of `initial_memory` with respect to `s`."""
        return (0.0,) * self.n_memory

    @abstractmethod
    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Value less ``slope * s``, from the memory of the last accepted step."""

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Memory after `s` has been accepted."""
        return ()

    def value(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any], slope: Any) -> Any:
        """Return the whole law."""
        return slope * s + self.deviation(ops, s, memory, p)

    def solve(
        self, s_free: Any, gain: Any, memory: Sequence[Any], p: Sequence[Any], w_last: Any
    ) -> Any:
        """Deviation `w` that satisfies ``s = s_free + gain * w``, ``w = deviation(s)``.

        CasADi expressions in and out. The default takes Newton steps from the last value; a law
        with a jump overrides it with its closed form.
        """
        import casadi as ca

        from bondgraph.backend import CASADI

        t = ca.SX.sym("t")
        w = self.deviation(CASADI, t, memory, p)
        residual = t - s_free - gain * w
        slope = 1 - gain * ca.jacobian(w, t) if isinstance(w, ca.SX) else ca.SX(1)
        s = s_free + gain * w_last
        step = ca.SX.sym("step")
        update = t - residual / slope
        update = ca.substitute(update, step, t)
        for _ in range(NEWTON_STEPS):
            s = ca.substitute(update, t, s)
        return ca.substitute(w, t, s) if isinstance(w, ca.SX) else ca.SX(w)
