"""What a loop needs of a bench."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Any, Protocol

from hardware.contracts import Acquisition, Clock
from hardware.recorder.station import GuardedVoltage, Preparation, no_preparation


class HeldOutput(GuardedVoltage, Protocol):
    """A guarded output as a loop uses it."""

    def approach(self, volts: float) -> float:
        """Go towards a voltage (V) as far as one update allows; return where it stands."""
        ...

    def read(self) -> float | None:
        """Voltage at the actuator as the device tells (V)."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class LoopStation:
    """An output, the sensor that is fed back, and one time for the program.

    Parameters
    ----------
    clock : Clock
        Time of the program; the loop's ticks are its.
    output : HeldOutput
        Guarded voltage of the actuator.
    sensor : Acquisition
        Drained at every tick; its newest sample is the reading.
    fastest : float
        Most ticks a second that envelope and sensor allow (Hz).
    bound : str
        Which of the two that is, for messages.
    preparation : Preparation
        Zero and air of the sensor.
    safety : context manager
        Entered around the loop; leaves the output at its safe value whatever happens.
    gains, noise : mapping
        As of `hardware.recorder.Station`.
    """

    clock: Clock
    output: HeldOutput
    sensor: Acquisition
    fastest: float
    bound: str
    preparation: Preparation = field(default_factory=no_preparation)
    safety: AbstractContextManager[Any] = field(default_factory=nullcontext)
    gains: Mapping[str, Any] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
