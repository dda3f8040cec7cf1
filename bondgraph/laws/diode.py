"""A resistor with a diode across it: proportional below a threshold, flatter beyond."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.elements import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops

NEWTON_STEPS = 5


@dataclass(frozen=True)
class Diode(Law):
    """``-lost w W((f - onset) / w)`` with Wright's W, ``W + ln W = z``: beside ``R f``.

    Exactly a resistor R with a diode in series with ``R_s`` across it, ``I_s`` far below the
    currents: ``(R + R_s) j + V_T ln(j / I_s) = R f`` has the solution ``j = V_T W(z) / (R + R_s)``,
    so ``lost = R^2 / (R + R_s)``, ``w = V_T / R`` and ``onset = -w ln(I_s (R + R_s) / V_T)``
    (T. C. Banwell, A. Jayakumar, Electronics Letters 36 (2000) 291). Passive while ``lost <= R``.

    Parameters
    ----------
    lost : float
        Start value of the resistance that conduction takes away.
    onset, width : float
        Start values of the flow at which it conducts, and of the rounding, flow units.
    sense : float
        1 if it conducts forwards, -1 if backwards; a fixed parameter.
    """

    lost: float = 0.0
    onset: float = 0.5
    width: Positive = 0.1
    sense: float = 1.0
    size: Positive = 1.0
    unit: str = "ohm"
    flow_unit: str = "A"
    starts: ClassVar[tuple[str, ...]] = (
        "lost", "onset", "width", "sense", "size", "unit", "flow_unit",
    )  # fmt: skip
    name: ClassVar[str] = "diode"
    energy: ClassVar[str] = "signal"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Lost resistance, onset, rounding, then the fixed sense."""
        w = self.width
        return (
            Parameter(f"lost_{element}", self.lost, self.unit, positive=False, scale=self.size),
            Parameter(f"onset_{element}", self.onset, self.flow_unit, positive=False, scale=w),
            Parameter(f"width_{element}", w, self.flow_unit, lower=1e-2 * w, upper=1e2 * w),
            Parameter(f"sense_{element}", self.sense, positive=False, fixed=True),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return what the flow through the diode takes off."""
        lost, onset, width, sense = p
        return -sense * lost * width * wright_omega(ops, (sense * s - onset) / width)


def wright_omega(ops: Ops, z: Any) -> Any:
    """Return W of ``W + ln W = z`` (R. M. Corless, D. J. Jeffrey, 2002).

    ``exp(y) + y = z`` for its logarithm is convex and rising, and Newton's steps start above the
    root: they descend without a safeguard.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> round(float(wright_omega(NUMPY, 1.0)), 9)
    1.0
    """
    y = ops.where(z < 1.0, z, ops.log(ops.maximum(z, 1.0)))
    for _ in range(NEWTON_STEPS):
        e = ops.exp(y)
        y = y - (e + y - z) / (e + 1.0)
    return ops.exp(y)
