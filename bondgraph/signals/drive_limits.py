"""What an amplifier and its load stand: range, slew and current."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.ops import FloatArray

_ROUNDING = 1e-9


class VoltageLimit(BondsightError, ValueError):
    """A command leaves the allowed voltages."""


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """Limits of value, slew and current.

    Parameters
    ----------
    low, high : float
        Smallest and largest value (V, or the unit of the drive).
    slew : float
        Largest rate of change, units per second.
    current : float
        Largest current, A; needs the capacitance. Nothing else does.
    capacitance : float, optional
        Of the load, F; the current is ``C dV/dt``.

    Raises
    ------
    UnusableInput
        If the limits leave no room.

    Examples
    --------
    >>> DriveLimits(0.0, 100.0).outside(np.array([-1.0, 50.0])).tolist()
    [True, False]
    """

    low: float = -math.inf
    high: float = math.inf
    slew: float = math.inf
    current: float = math.inf
    capacitance: float | None = None

    def __post_init__(self) -> None:
        """Refuse limits that leave no room."""
        if not self.low < self.high:
            raise UnusableInput(
                f"drive limits: {self.low:g} .. {self.high:g} leaves no room; give the lower first"
            )
        if not (self.slew > 0.0 and self.current > 0.0):
            raise UnusableInput("drive limits: slew and current must be positive")
        if math.isfinite(self.current) and self.capacitance is None:
            raise UnusableInput(
                f"drive limits: current = {self.current:g} A needs the capacitance of the load, "
                "through which alone it bounds the slew (i = C dV/dt): give capacitance in F, or "
                "slew in place of current"
            )
        if self.capacitance is not None and not self.capacitance > 0.0:
            raise UnusableInput("drive limits: the capacitance must be positive")

    @property
    def steepest(self) -> float:
        """Largest rate of change that slew and current allow, units per second."""
        by_current = self.current / self.capacitance if self.capacitance else math.inf
        return min(self.slew, by_current)

    @property
    def slack(self) -> float:
        """Return what passes as rounding: an inverse that should end at 0 V gives -1e-15 V."""
        span = self.high - self.low
        return _ROUNDING * span if math.isfinite(span) else 0.0

    def outside(self, values: FloatArray) -> np.ndarray:
        """Return where the range is left or the value is NaN, bool, shape of `values`."""
        low, high = self.low - self.slack, self.high + self.slack
        return np.asarray(~((values >= low) & (values <= high)))

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

    def check(self, time: FloatArray, volt: FloatArray, what: str) -> None:
        """Raise `UnusableInput` if a voltage leaves the range or changes too fast."""
        if self.outside(volt).any():
            raise UnusableInput(
                f"{what}: {volt.min():.4g} .. {volt.max():.4g} V leaves the limits {self.low:g} .. "
                f"{self.high:g} V; lower the amplitude or move the bias"
            )
        fastest = float(np.abs(np.diff(volt) / np.diff(time)).max(initial=0.0))
        if not fastest <= self.steepest * (1 + _ROUNDING):
            raise UnusableInput(
                f"{what}: {self._asks(fastest)}; be {fastest / self.steepest:.3g} times slower"
            )

    def _asks(self, slew: float) -> str:
        if self.capacitance and slew * self.capacitance > self.current:
            wanted, given = (1e3 * v for v in (slew * self.capacitance, self.current))
            return f"{slew:.4g} V/s asks for {wanted:.4g} mA, more than {given:.4g} mA"
        return f"{slew:.4g} V/s is more than {self.slew:.4g} V/s"
