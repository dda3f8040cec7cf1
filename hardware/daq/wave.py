"""A waveform written sample by sample under control of the program's clock.

These cards have no sample clock for their outputs (comedi has no timed commands for them), so the
program is the clock. Every sample keeps its measured instant, and late ones are flagged.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import final

import numpy as np
from numpy.typing import NDArray

from bondgraph.errors import UnusableInput
from hardware.amplifier.data import Amplifier
from hardware.contracts import Chunk, Clock, Flag, Identity, Written
from hardware.daq.card import Card
from hardware.daq.codes import dac_codes, dac_volts
from hardware.daq.registers import Access
from hardware.daq.schedule import Schedule
from hardware.errors import HardwareError, ProtocolFault

__all__ = ["SampleClock", "SoftwareTimedWave", "Wiring"]

REPORT = 0.02
_UNITS = {"V": "V", "V_mon": "V", "i": "A", "instant": "s"}


class SampleClock(Enum):
    """What the clock line does with every sample."""

    NONE = "none"
    TOGGLE = "toggle"
    """Changes its level: the receiver counts both edges."""
    PULSE = "pulse"
    """Rises with the sample and falls at once: the receiver counts rising edges."""


@dataclass(frozen=True, slots=True)
class Wiring:
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


@final
class SoftwareTimedWave:
    """Plays waveforms through a card and an amplifier; unguarded.

    At every tick the inputs are sampled first and the new value is written right after, so a
    monitor reading belongs to the voltage just before its own sample, settled since the last one.

    Parameters
    ----------
    card : Card
        Powered up.
    amplifier : Amplifier
        Between volts at the actuator and volts of the card.
    wiring : Wiring
        What is connected.
    clock : Clock, optional
        That of the card by default.
    haste : float
        See `Schedule`.
    """

    def __init__(
        self,
        card: Card,
        amplifier: Amplifier,
        wiring: Wiring | None = None,
        *,
        clock: Clock | None = None,
        haste: float = 1.1,
    ) -> None:
        self._card = card
        self._amplifier = amplifier
        self._wiring = Wiring() if wiring is None else wiring
        self._clock = card.clock if clock is None else clock
        self._haste = haste
        self._names = amplifier.monitors.channels() if self._wiring.monitors else ()
        if len(self._names) != len(self._wiring.monitors):
            raise UnusableInput(
                f"{amplifier.name} has monitors {amplifier.monitors.channels()}, the wiring has "
                f"inputs {self._wiring.monitors}; name one input for each"
            )
        self._codes: NDArray[np.uint16] = np.zeros(0, np.uint16)
        self._rate = 0.0
        self._playing = False

    @property
    def identity(self) -> Identity:
        """The card."""
        return self._card.identity

    @property
    def rate(self) -> float:
        """Rate of the loaded waveform (Hz), by the program's clock."""
        return self._rate

    def load(self, volts: NDArray[np.float64], rate: float) -> None:
        """Convert a waveform (V at the actuator, ``(n,)``) and keep it.

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
        self._codes = dac_codes(inputs)
        self._rate = rate

    def play(self) -> Iterator[Written]:
        """Write all samples; yields about every 20 ms.

        Raises
        ------
        HardwareError
            With the chunks that were not reported yet as `partial`.
        """
        if self._codes.size == 0:
            raise ProtocolFault("no waveform is loaded; call load() first")
        self._card.require_ready()
        return self._play()

    def abort(self) -> None:
        """Stop before the next sample."""
        self._playing = False

    def _play(self) -> Iterator[Written]:
        total = self._codes.size
        block = max(1, round(REPORT * self._rate))
        schedule = Schedule(self._clock, 1.0 / self._rate, self._haste)
        if self._names:
            self._card.select(self._wiring.monitors)
        self._playing = True
        late = 0
        try:
            schedule.begin(min(1e-3, 10.0 / self._rate))
            for first in range(0, total, block):
                count = min(block, total - first)
                chunk = self._block(schedule, first, count)
                late += int(np.count_nonzero(chunk.flags & Flag.LATE))
                yield Written(first + chunk.n, total, late, (chunk,))
                if chunk.n < count:
                    return
        finally:
            self._playing = False
            self._lower_lines()

    def _block(self, schedule: Schedule, first: int, count: int) -> Chunk:
        """Write some samples and return what was written and read."""
        instants = np.zeros(count)
        lateness = np.zeros(count)
        readings = np.zeros((count, len(self._names)))
        done = 0
        try:
            for k in range(count):
                if not self._playing:
                    break
                lateness[k], instants[k] = schedule.wait(first + k)
                self._tick(first + k, readings[k])
                done = k + 1
        except HardwareError as error:
            raise error.carrying(
                (self._chunk(first, instants[:done], lateness[:done], readings[:done]),)
            ) from None
        return self._chunk(first, instants[:done], lateness[:done], readings[:done])

    def _tick(self, k: int, reading: NDArray[np.float64]) -> None:
        """One sample: sample the inputs, write the output, move the lines, collect the inputs."""
        card, wiring = self._card, self._wiring
        accesses: list[Access] = []
        if self._names:
            accesses.append(card.start_access())
        accesses.append(card.output_access(wiring.output, int(self._codes[k])))
        lines = self._lines_at(k)
        if lines != card.lines:
            accesses.append(card.lines_access(lines))
        if wiring.clocking is SampleClock.PULSE and wiring.clock is not None:
            accesses.append(card.lines_access(lines & ~(1 << wiring.clock)))
        accesses.append(card.state_access())
        state = card.registers.batch(accesses)[-1]
        if self._names:
            reading[:] = card.collect(state)
        else:
            card.require_present(state)

    def _lines_at(self, k: int) -> int:
        wiring, lines = self._wiring, self._card.lines
        if wiring.trigger is not None:
            lines |= 1 << wiring.trigger
        if wiring.clock is not None and wiring.clocking is SampleClock.PULSE:
            lines |= 1 << wiring.clock
        elif wiring.clock is not None and wiring.clocking is SampleClock.TOGGLE:
            mask = 1 << wiring.clock
            lines = lines & ~mask if k % 2 else lines | mask
        return lines

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
        first: int,
        instants: NDArray[np.float64],
        lateness: NDArray[np.float64],
        readings: NDArray[np.float64],
    ) -> Chunk:
        n = instants.size
        written = dac_volts(self._codes[first : first + n])
        channels = {"V": self._amplifier.output_record(written), "instant": instants}
        flags = np.where(lateness > 0.5 / self._rate, int(Flag.LATE), 0)
        for column, name in enumerate(self._names):
            raw = readings[:, column]
            channels[name] = self._amplifier.monitors.scaled(name, raw)
            flags = flags | np.where(self._card.saturated(raw), int(Flag.SATURATED), 0)
        return Chunk(
            "output", first, channels, {k: _UNITS[k] for k in channels}, flags.astype(np.uint16)
        )
