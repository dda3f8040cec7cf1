"""The devices of one bench, put together once."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Any, Protocol

from numpy.typing import ArrayLike

from hardware.contracts import Acquisition, Air, Clock, VoltageOut, WaveOut
from hardware.optics import Ellipse


class GuardedVoltage(VoltageOut, Protocol):
    """A guarded output as the recorder uses it."""

    def power_up(self) -> None:
        """Bring the device to its safe value by its safe order."""
        ...

    def tend(self) -> None:
        """Feed a watchdog and end what lasts too long."""
        ...

    def compare(self, commanded: ArrayLike, read: ArrayLike, before: int = 0) -> int:
        """Hold readings of a monitor against their commands; refuse what does not follow."""
        ...

    def provenance(self) -> Mapping[str, Any]:
        """Return limits, device and state as plain values."""
        ...


class Preparation(Protocol):
    """What a sensor needs before a take."""

    def zero(self) -> None:
        """Set the displacement to zero here."""
        ...

    def air(self) -> Air | None:
        """Return the state of the air now; None if there is no way to know."""
        ...


class _Nothing:
    def zero(self) -> None:
        """Do nothing."""

    def air(self) -> Air | None:
        """Know nothing."""
        return None


def no_preparation() -> Preparation:
    """Return what a sensor without zero and air sensors needs: nothing."""
    return _Nothing()


@dataclass(frozen=True, slots=True, eq=False)
class Station:
    """An output, sensors, and one time for the program.

    Parameters
    ----------
    clock : Clock
        Time of the program.
    output : GuardedVoltage
        Guarded voltage of the actuator.
    wave : WaveOut
        Guarded waveforms of the same output.
    sensors : sequence of Acquisition
        Streams recorded during a take, each on its own clock.
    preparation : Preparation
        Zero and air of the displacement sensor.
    safety : context manager
        Entered around a take; leaves the output at its safe value whatever happens.
    gains : mapping
        Calibrations, plain values, for the provenance.
    lag, lag_error : float
        First-order lag of the amplifier and its standard deviation (s), where they are known; two
        clocks are told apart much better then.
    noise : mapping
        Standard deviation of the noise of channels, SI, where it is known.
    ellipse : Ellipse, optional
        Of the interferometer's calibration.
    remarks : tuple of str
        What was asked for and is done otherwise; recordings carry it.
    """

    clock: Clock
    output: GuardedVoltage
    wave: WaveOut
    sensors: tuple[Acquisition, ...]
    preparation: Preparation = field(default_factory=no_preparation)
    safety: AbstractContextManager[Any] = field(default_factory=nullcontext)
    gains: Mapping[str, Any] = field(default_factory=dict)
    lag: float | None = None
    lag_error: float = 0.0
    noise: Mapping[str, float] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    ellipse: Ellipse | None = None
