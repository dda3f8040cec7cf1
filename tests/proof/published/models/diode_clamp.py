"""A resistor with a diode across it: proportional one way, logarithmic the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.ops import Ops

STEPS = 6
SMALLEST = 1e-9


@dataclass(frozen=True)
class DiodeClamp(Law):
    """Voltage over current of ``R_p`` parallel to a diode in series with ``R_d``.

    The diode follows Shockley's equation ``j = I_s (exp(v_d/V_T) - 1)``; ``V_k``, its voltage at a
    reference current I far above I_s, is better conditioned than the saturation current
    ``I_s = I exp(-V_k/V_T)``.

    The equation for ``z = ln((j + I_s)/I)`` is convex and rising; Newton's steps start above its
    root, where each branch on its own bounds it, and so descend without a safeguard.

    Parameters
    ----------
    leak, series : float
        Start values of ``R_p`` and ``R_d``, ohm, > 0.
    knee : float
        Start value of ``V_k``, V.
    thermal : float
        Start value of ``V_T`` (thermal voltage times emission coefficient), V, > 0.
    current : float
        Reference current I, A; a number, not a parameter.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> law = DiodeClamp(leak=1e4, series=10.0, knee=0.6, thermal=0.05)
    >>> round(float(law.voltage(NUMPY, -1e-4, (1e4, 10.0, 0.6, 0.05))), 3)
    -1.0
    """

    leak: float = 1e4
    series: float = 10.0
    knee: float = 0.6
    thermal: float = 0.05
    current: float = 1e-3
    name: ClassVar[str] = "diode_clamp"
    energy: ClassVar[str] = "dissipates"

    @property
    def slope(self) -> float:
        """Half of the start value of ``R_p``: between the slopes of both ways."""
        return 0.5 * self.leak

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``R_p``, ``R_d``, ``V_k`` and ``V_T``."""
        return (
            Parameter(f"R_p_{element}", self.leak, "ohm"),
            Parameter(f"R_d_{element}", self.series, "ohm"),
            Parameter(f"V_k_{element}", self.knee, "V", positive=False, lower=0.0, scale=0.1),
            Parameter(f"V_T_{element}", self.thermal, "V"),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Voltage less ``slope * s``."""
        return self.voltage(ops, s, p) - self.slope * s

    def voltage(self, ops: Ops, i: Any, p: Sequence[Any]) -> Any:
        """Voltage at current `i` (A) with ``p = (R_p, R_d, V_k, V_T)``."""
        leak, series, knee, thermal = p
        share = 1.0 + series / leak
        least = self.current * ops.exp(-knee / thermal)  # saturation current
        given = i + share * least
        without = (leak * given - knee) / thermal  # all current through the resistor
        alone = ops.log(ops.maximum(given, SMALLEST) / (share * self.current))  # through the diode
        z = ops.where(given > SMALLEST, ops.minimum(without, alone), without)
        for _ in range(STEPS):
            through = share * self.current * ops.exp(z)
            excess = through + (knee + thermal * z) / leak - given
            z = z - excess / (through + thermal / leak)
        return leak * (i + least - self.current * ops.exp(z))
