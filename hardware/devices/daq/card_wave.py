"""What every player of waveforms on a Humusoft card shares: wiring, loading, the record."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Flag, Identity, WaveProgress
from hardware.devices.amplifier.data import Amplifier
from hardware.devices.daq.card import Card
from hardware.devices.daq.codes import dac_codes, dac_volts
from hardware.errors import HardwareError, ProtocolFault

REPORT = 0.02
"""Time between two reports (s)."""
_UNITS = {"V": "V", "V_mon": "V", "i": "A", "instant": "s"}


class SampleClock(Enum):
    """What the clock line does with every sample."""

    NONE = "none"
    TOGGLE = "toggle"
    """Changes its level: the receiver counts both edges."""
    PULSE = "pulse"
    """Rises with the sample and falls at once: the receiver counts rising edges."""


@dataclass(frozen=True, slots=True)
class CardWiring:
    """What is connected to the card.

    Parameters
    ----------
    output : int
        Analogue output to the amplifier.
    monitors : tuple of int
        Analogue inputs of the monitors, in the order of ``amplifier.monitors.channels()``; empty if
        they are not connected.
    trigger : int, optional
        Digital output that rises with the first sample and falls after the last one.
    clock : int, optional
        Digital output of the sample clock.
    clocking : SampleClock
        What the clock line does.
    """

    output: int = 0
    monitors: tuple[int, ...] = ()
    trigger: int | None = None
    clock: int | None = None
    clocking: SampleClock = SampleClock.NONE


@dataclass(frozen=True, slots=True, eq=False)
class LoadedWave:
    """A waveform as converted; whoever plays it keeps it, so that loading changes nothing then.

    Parameters
    ----------
    codes : ndarray
        (n,), output codes.
    rate : float
        Hz.
    """

    codes: NDArray[np.uint16]
    rate: float

    def __post_init__(self) -> None:
        """Freeze."""
        self.codes.setflags(write=False)

    @property
    def total(self) -> int:
        """Number of samples."""
        return int(self.codes.size)


class CardWave(ABC):
    """Plays waveforms through a card and an amplifier; unguarded.

    At every tick the inputs are sampled first and the new value is written right after, so a
    monitor reading belongs to the voltage just before its own sample, settled since the last one.

    Parameters
    ----------
    card : Card
        Powered up.
    amplifier : Amplifier
        Between volts at the actuator and volts of the card.
    wiring : CardWiring
        What is connected.
    haste : float
        How much faster than planned samples may follow each other after a stall, >= 1.
    """

    def __init__(
        self,
        card: Card,
        amplifier: Amplifier,
        wiring: CardWiring | None = None,
        *,
        haste: float = 1.1,
    ) -> None:
        if haste < 1.0:
            raise UnusableInput(f"haste {haste}: a player cannot catch up below 1; try 1.1")
        self._card = card
        self._amplifier = amplifier
        self._wiring = CardWiring() if wiring is None else wiring
        self.haste = haste
        self._names = amplifier.monitored(self._wiring.monitors)
        self._loaded = LoadedWave(np.zeros(0, np.uint16), 0.0)

    @property
    @abstractmethod
    def position(self) -> int:
        """Samples of the last waveform that were really written."""

    @abstractmethod
    def abort(self) -> None:
        """Stop before the next sample; never raises."""

    @abstractmethod
    def _begin(self, wave: LoadedWave) -> Iterator[WaveProgress]:
        """Play a waveform on a card that is ready."""

    @property
    def identity(self) -> Identity:
        """The card."""
        return self._card.identity

    @property
    def rate(self) -> float:
        """Rate of the loaded waveform (Hz), by the program's clock."""
        return self._loaded.rate

    def load(self, volts: NDArray[np.float64], rate: float) -> None:
        """Convert a waveform (V at the actuator, ``(n,)``) and keep it for the next `play`.

        Raises
        ------
        LimitViolation
            A sample is no number or outside the amplifier's limits.
        UnusableInput
            No samples, or no rate.
        """
        record = np.asarray(volts, float)
        if record.ndim != 1 or record.size == 0 or not 0.0 < rate < 1e7:
            raise UnusableInput(
                f"waveform of shape {record.shape} at {rate} Hz; give (n,) samples and a rate > 0"
            )
        inputs = self._amplifier.input_record(record)
        self._card.require_in_range(inputs)
        self._loaded = LoadedWave(dac_codes(inputs), rate)

    def play(self) -> Iterator[WaveProgress]:
        """Write all samples; yields about every 20 ms.

        Raises
        ------
        HardwareError
            With the chunks that were not reported yet as `partial`.
        """
        if not self._loaded.total:
            raise ProtocolFault("no waveform is loaded; call load() first")
        self._card.require_ready()
        return self._begin(self._loaded)

    def _lower_lines(self) -> None:
        wiring = self._wiring
        used = [b for b in (wiring.trigger, wiring.clock) if b is not None]
        if not used or not self._card.ready:
            return
        lines = self._card.lines & ~sum(1 << b for b in set(used))
        try:
            self._card.registers.batch((self._card.lines_access(lines),))
        except HardwareError:
            # what stopped the playing is the error to tell
            return

    def _chunk(
        self,
        wave: LoadedWave,
        first: int,
        instants: NDArray[np.float64],
        lateness: NDArray[np.float64],
        readings: NDArray[np.float64],
    ) -> Chunk:
        n = instants.size
        written = dac_volts(wave.codes[first : first + n])
        channels = {"V": self._amplifier.output_record(written), "instant": instants}
        flags = np.where(lateness > 0.5 / wave.rate, int(Flag.LATE), 0)
        for column, name in enumerate(self._names):
            raw = readings[:, column]
            channels[name] = self._amplifier.monitors.scaled(name, raw)
            flags = flags | np.where(self._card.saturated(raw), int(Flag.SATURATED), 0)
        return Chunk(
            "output", first, channels, {k: _UNITS[k] for k in channels}, flags.astype(np.uint16)
        )
