"""What is known about an output."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class OutputState(Enum):
    """Whether somebody has to be afraid of the terminals."""

    PARKED = "parked"
    """At its safe value."""
    DRIVEN = "driven"
    """At the voltage last commanded, or on the way along a waveform."""
    UNKNOWN = "unknown"
    """It may carry any voltage of the device."""


@dataclass(frozen=True, slots=True)
class OutputStatus:
    """State, why, and what follows.

    Parameters
    ----------
    state : OutputState
    reason : str
        How it came to this state.
    volts : float or None
        Voltage last commanded (V); None while unknown.
    has_watchdog : bool
        Whether the device parks itself when the program is gone.
    """

    state: OutputState
    reason: str
    volts: float | None
    has_watchdog: bool

    def __str__(self) -> str:
        """Return it as a sentence."""
        if self.state is OutputState.UNKNOWN:
            return (
                f"output unknown ({self.reason}): take it as live until stop() or power_up(); "
                f"{self._guarantee}"
            )
        return f"output {self.state.value} at {self.volts:g} V ({self.reason}); {self._guarantee}"

    @property
    def _guarantee(self) -> str:
        if self.has_watchdog:
            return "its watchdog parks it when the program is gone"
        return "no watchdog: when the program or the link is gone it keeps its voltage"
