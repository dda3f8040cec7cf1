"""What drives the actuator: single voltages and waveforms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hardware.contracts.acquisition import Identity
from hardware.contracts.chunk import Chunk


@runtime_checkable
class RawOutput(Protocol):
    """An output without protection; only the envelope's guard may hold one.

    Voltages are those at the actuator; the implementation knows gain and offset of its amplifier.
    """

    @property
    def identity(self) -> Identity:
        """The device."""
        ...

    @property
    def has_watchdog(self) -> bool:
        """Whether the device itself goes to its safe value when the program is gone."""
        ...

    def power_up(self) -> None:
        """Bring the device from unknown to its safe value, in the order that never overshoots."""
        ...

    def write(self, volts: float) -> None:
        """Set the voltage at the actuator (V) now."""
        ...

    def read(self) -> float | None:
        """Voltage at the actuator (V); None where the device cannot tell."""
        ...

    def close(self) -> None:
        """Release the link; never raises and never hangs."""
        ...


@runtime_checkable
class VoltageOut(Protocol):
    """A guarded output; see `hardware.envelope`."""

    @property
    def identity(self) -> Identity:
        """The device."""
        ...

    @property
    def present(self) -> float | None:
        """Voltage last commanded (V); None while unknown."""
        ...

    def set(self, volts: float) -> None:
        """Set a voltage (V); `LimitViolation` before anything is sent."""
        ...

    def ramp(self, volts: float, rate: float | None = None) -> None:
        """Go to a voltage (V) at a rate (V/s), by default the envelope's gentle one."""
        ...

    def stop(self) -> None:
        """Ramp to the safe value; the last resort of every error path."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class WaveProgress:
    """What a waveform output has really done so far.

    Parameters
    ----------
    samples : int
        Samples written.
    total : int
        Samples asked for.
    late : int
        Samples written later than half a period after their instant.
    chunks : sequence of Chunk
        Stream ``"output"`` since the last report: channel ``V`` (V, commanded), where the device
        has inputs also ``V_mon`` (V) and ``i`` (A), and ``instant`` (s).
    """

    samples: int
    total: int
    late: int = 0
    chunks: Sequence[Chunk] = ()


@runtime_checkable
class WaveOut(Protocol):
    """A guarded output of whole waveforms."""

    @property
    def rate(self) -> float:
        """Nominal rate of the prepared waveform (Hz), on the device's own clock."""
        ...

    def prepare(self, volts: NDArray[np.float64], rate: float) -> None:
        """Check a waveform (V, (n,)) at a rate (Hz) against the envelope and load it."""
        ...

    def play(self) -> Iterator[WaveProgress]:
        """Play it; yields about every 20 ms so that others are polled, and at the end.

        Closing the iterator early stops the output where it is; the guard then ramps it down.
        """
        ...

    def abort(self) -> None:
        """Stop playing; never raises."""
        ...
