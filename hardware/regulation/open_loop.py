"""No feedback: the reference is the voltage; what a loop is compared with, and slow sensors."""

from __future__ import annotations

from typing import final


@final
class OpenLoop:
    """A `Controller` that gives its reference out as it is (V)."""

    def begin(self, reading: float, volts: float) -> None:
        """Nothing to begin."""

    def decide(self, reading: float, reference: float) -> float:
        """Return the reference (V)."""
        return reference

    def applied(self, volts: float) -> None:
        """Nothing follows."""
