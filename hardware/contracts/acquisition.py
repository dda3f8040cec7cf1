"""What gives samples: an interferometer, a converter, a controller's recorder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from hardware.contracts.chunk import Chunk


@dataclass(frozen=True, slots=True)
class Identity:
    """Who measured.

    Parameters
    ----------
    maker, model, serial, firmware : str
        As the device tells; empty where it does not.
    """

    maker: str = ""
    model: str = ""
    serial: str = ""
    firmware: str = ""


@dataclass(frozen=True, slots=True)
class Air:
    """State of the air and what was corrected with it.

    Parameters
    ----------
    temperature : float
        K.
    pressure : float
        Pa.
    humidity : float
        Relative humidity, 0 to 1.
    index : float
        Refraction index used.
    measured : bool
        Whether sensors gave it (and not the user or a default).
    age : float
        Age of the oldest sensor value when it was read (s).
    """

    temperature: float
    pressure: float
    humidity: float
    index: float
    measured: bool = True
    age: float = 0.0


@runtime_checkable
class Tried(Protocol):
    """An `Acquisition` that can tell before anything moves whether it takes its clock."""

    def try_settings(self) -> None:
        """Let the device take mode and rate without starting; `UnusableInput` if it does not."""
        ...


@runtime_checkable
class Acquisition(Protocol):
    """One stream of samples: prepared, started, drained piece by piece, ended.

    The order is ``kickoff``, then ``poll`` until ``done``, then ``finish``; ``abort`` at any time
    and any number of times. Nothing blocks longer than its own time-out; waiting is done between
    polls by the one who drives.
    """

    @property
    def stream(self) -> str:
        """Name of the stream."""
        ...

    @property
    def rate(self) -> float:
        """Nominal rate (Hz), on the device's own clock."""
        ...

    @property
    def identity(self) -> Identity:
        """The device."""
        ...

    @property
    def done(self) -> bool:
        """Whether all that was asked for has been handed out by ``poll``."""
        ...

    def kickoff(self) -> None:
        """Arm or start; samples come from the trigger on, or at once."""
        ...

    def poll(self) -> Sequence[Chunk]:
        """Return what arrived since the last call; empty if nothing did.

        Raises
        ------
        HardwareError
            With the chunks that had arrived in this call as `partial`.
        """
        ...

    def finish(self) -> Sequence[Chunk]:
        """Stop the device in order and return the rest."""
        ...

    def abort(self) -> None:
        """Stop the device whatever its state; never raises and never hangs."""
        ...
