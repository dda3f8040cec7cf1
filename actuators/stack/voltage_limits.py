"""What a stack and its amplifier stand: voltage, and current at the stack's capacitance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput

__all__ = ["VoltageLimits"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class VoltageLimits:
    """What the stack and its amplifier stand.

    Parameters
    ----------
    minimum, maximum : float
        V; a unipolar multilayer stack stands a little reverse voltage.
    current : float
        Largest current of the amplifier, A.
    capacitance : float
        Of the stack, F; the current limits the slew rate to ``current / capacitance``.
    """

    minimum: float = -20.0
    maximum: float = 120.0
    current: float = 0.2
    capacitance: float = 1.5e-6

    def __post_init__(self) -> None:
        """Refuse limits that leave no room."""
        if not self.minimum < self.maximum:
            raise UnusableInput(f"voltage limits {self.minimum} .. {self.maximum} V leave no room")
        if not (self.current > 0.0 and self.capacitance > 0.0):
            raise UnusableInput("voltage limits: current and capacitance must be positive")

    @property
    def slew(self) -> float:
        """Largest rate of the voltage, V/s."""
        return self.current / self.capacitance

    def check(self, time: FloatArray, volt: FloatArray, what: str) -> None:
        """Raise `UnusableInput` if a voltage leaves the limits or changes too fast."""
        low, high = float(volt.min()), float(volt.max())
        slack = 1e-9 * (self.maximum - self.minimum)
        if not (low >= self.minimum - slack and high <= self.maximum + slack):
            raise UnusableInput(
                f"{what}: {low:.4g} .. {high:.4g} V leaves the limits {self.minimum:g} .. "
                f"{self.maximum:g} V; lower the amplitude or move the bias"
            )
        fastest = float(np.abs(np.diff(volt) / np.diff(time)).max(initial=0.0))
        if not fastest <= self.slew * (1 + 1e-9):
            raise UnusableInput(
                f"{what}: {fastest:.4g} V/s asks for {1e3 * fastest * self.capacitance:.4g} mA, "
                f"more than {1e3 * self.current:.4g} mA; be {fastest / self.slew:.3g} times slower"
            )
