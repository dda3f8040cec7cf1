"""The voltages an actuator may see, and the refusal of commands that leave them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.ops import FloatArray

__all__ = ["P840_1", "UNIPOLAR", "VoltageLimit", "VoltageRange"]

_ROUNDING = 1e-9


class VoltageLimit(BondsightError, ValueError):
    """A command leaves the allowed voltages."""


@dataclass(frozen=True, slots=True)
class VoltageRange:
    """Allowed voltages ``low <= V <= high``.

    Parameters
    ----------
    low, high : float
        V.

    Raises
    ------
    UnusableInput
        If a limit is not finite or ``low >= high``.

    Examples
    --------
    >>> Envelope(0.0, 100.0).outside(np.array([-1.0, 50.0])).tolist()
    [True, False]
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        """Check the order of the limits."""
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise UnusableInput(
                f"voltage limits {self.low} .. {self.high}: both must be finite, the first smaller"
            )

    def outside(self, voltage: FloatArray) -> np.ndarray:
        """Return where the limits are left or the voltage is NaN, bool, shape of `voltage`.

        A billionth of the range is rounding and passes: an inverse that should end at 0 V gives
        -1e-15 V.
        """
        slack = _ROUNDING * (self.high - self.low)
        return np.asarray(~((voltage >= self.low - slack) & (voltage <= self.high + slack)))

    def require(self, voltage: FloatArray, what: str) -> FloatArray:
        """Return the voltage, its rounding trimmed, or raise.

        Parameters
        ----------
        voltage : ndarray, shape (N,), V
        what : str
            Origin of the command, for the message.

        Raises
        ------
        VoltageLimit
            Naming the first sample outside, its voltage, and how many there are.
        """
        bad = np.flatnonzero(self.outside(voltage))
        if bad.size:
            raise VoltageLimit(
                f"{what}: sample {bad[0]} needs {voltage[bad[0]]:.4g} V and {bad.size} of "
                f"{voltage.size} samples leave {self.low:g} .. {self.high:g} V (range "
                f"{voltage.min():.4g} .. {voltage.max():.4g} V); lower or shift the reference, "
                "widen the envelope if the actuator allows it, or take the limited form"
            )
        return np.asarray(np.clip(voltage, self.low, self.high))


UNIPOLAR = VoltageRange(0.0, 100.0)
"""0 to 100 V, the range of all measurements of the stack actuator thesis."""

P840_1 = VoltageRange(-20.0, 120.0)
"""What the data sheet of the P-840.1 allows."""
