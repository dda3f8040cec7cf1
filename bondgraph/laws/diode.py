"""A resistor with a diode across it: proportional below a threshold, flatter beyond."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.shared_slope import SharedSlope
from bondgraph.support.bounds import NonZero, Positive
from bondgraph.support.ops import Ops

NEWTON_STEPS = 5


@dataclass(frozen=True, kw_only=True)
class Diode(SharedSlope):
    """``-share R w W((f - onset) / w)`` beside ``R f``, with Wright's W, ``W + ln W = z``.

    Exactly a resistor R with a diode in series with ``R_s`` across it, ``I_s`` far below the
    currents: ``(R + R_s) j + V_T ln(j / I_s) = R f`` has the solution ``j = V_T W(z) / (R + R_s)``,
    so ``share = R / (R + R_s)``, ``w = V_T / R`` and ``onset = -w ln(I_s (R + R_s) / V_T)``
    (T. C. Banwell, A. Jayakumar, Electronics Letters 36 (2000) 291).

    Parameters
    ----------
    share : float
        Start value of the part of the resistance that conduction takes away, 0 to 1.
    onset, width : float
        Start values of the flow at which it conducts, and of the rounding, flow units.
    sense : float
        1 if it conducts forwards, -1 if backwards; a fixed parameter.

    Examples
    --------
    >>> law = Diode(coefficient="r", share=0.4)
    >>> [p.name for p in law.parameters("r")]
    ['r', 'share_r', 'onset_r', 'width_r', 'sense_r']
    """

    share: float = 0.0
    onset: float = 0.5
    width: Positive = 0.1
    sense: NonZero = 1.0
    unit: str = "A"
    starts: ClassVar[tuple[str, ...]] = (
        *SharedSlope.shared, "share", "onset", "width", "sense", "unit",
    )  # fmt: skip
    name: ClassVar[str] = "diode"
    meanings: ClassVar[Mapping[str, str]] = {
        "k_own": "resistance where it does not conduct",
        "share": "part of the resistance that conduction takes away",
        "onset": "flow at which it begins to conduct",
        "width": "how gradually it begins",
        "sense": "direction in which it conducts",
    }
    energy: ClassVar[str] = "signal"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Resistance, share, onset, rounding, then the fixed sense."""
        w, unit = self.width, self.unit
        return (
            self.slope_parameter(element),
            Parameter(
                f"share_{element}", self.share, positive=False, lower=0.0, upper=1.0, scale=0.1
            ),
            Parameter(f"onset_{element}", self.onset, unit, positive=False, scale=w),
            Parameter(f"width_{element}", w, unit, lower=1e-2 * w, upper=1e2 * w),
            Parameter(f"sense_{element}", self.sense, positive=False, fixed=True),
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return what the flow through the diode takes off."""
        resistance, share, onset, width, sense = p
        lost = share * self.own_slope(resistance)
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
