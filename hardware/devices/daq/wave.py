"""A waveform written sample by sample under control of the program's clock.

These cards have no sample clock for their outputs (comedi has no timed commands for them), so the
program is the clock. Every sample keeps its measured instant, and late ones are flagged.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Chunk, Clock, Flag, WaveProgress
from hardware.devices.amplifier.data import Amplifier
from hardware.devices.daq.card import Card
from hardware.devices.daq.card_wave import REPORT, CardWave, CardWiring, LoadedWave, SampleClock
from hardware.devices.daq.registers import Access
from hardware.devices.daq.schedule import Schedule
from hardware.errors import HardwareError


@final
class SoftwareTimedWave(CardWave):
    """Plays on any clock, in the thread of the one who iterates.

    What the iterating program does between two reports makes samples late; `CompiledWave` plays in
    a thread of its own.

    Parameters
    ----------
    card, amplifier, wiring, haste
        See `CardWave`.
    clock : Clock, optional
        That of the card by default.
    """

    def __init__(
        self,
        card: Card,
        amplifier: Amplifier,
        wiring: CardWiring | None = None,
        *,
        clock: Clock | None = None,
        haste: float = 1.1,
    ) -> None:
        super().__init__(card, amplifier, wiring, haste=haste)
        self._clock = card.clock if clock is None else clock
        self._playing = False
        self._position = 0

    @property
    def position(self) -> int:
        """Samples of the last waveform that were really written."""
        return self._position

    def abort(self) -> None:
        """Stop before the next sample."""
        self._playing = False

    def _begin(self, wave: LoadedWave) -> Iterator[WaveProgress]:
        self._playing = True
        self._position = 0
        return self._play(wave)

    def _play(self, wave: LoadedWave) -> Iterator[WaveProgress]:
        total = wave.total
        block = max(1, round(REPORT * wave.rate))
        schedule = Schedule(self._clock, 1.0 / wave.rate, self.haste)
        if self._names:
            self._card.select(self._wiring.monitors)
        late = 0
        try:
            schedule.begin(min(1e-3, 10.0 / wave.rate))
            for first in range(0, total, block):
                while block == 1 and self._playing and schedule.slack(first) > 1.5 * REPORT:
                    # a slow waveform must not keep the others from being polled
                    self._clock.sleep(REPORT)
                    yield WaveProgress(first, total, late)
                count = min(block, total - first)
                chunk = self._block(wave, schedule, first, count)
                late += int(np.count_nonzero(chunk.flags & Flag.LATE))
                yield WaveProgress(first + chunk.n, total, late, (chunk,) if chunk.n else ())
                if chunk.n < count:
                    return
        finally:
            self._playing = False
            self._lower_lines()

    def _block(self, wave: LoadedWave, schedule: Schedule, first: int, count: int) -> Chunk:
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
                self._tick(wave, first + k, readings[k], schedule)
                done = k + 1
        except HardwareError as error:
            raise error.carrying(
                (self._chunk(wave, first, instants[:done], lateness[:done], readings[:done]),)
            ) from None
        return self._chunk(wave, first, instants[:done], lateness[:done], readings[:done])

    def _tick(
        self, wave: LoadedWave, k: int, reading: NDArray[np.float64], schedule: Schedule
    ) -> None:
        """One sample: sample the inputs, write the output, move the lines, collect the inputs."""
        card, wiring = self._card, self._wiring
        accesses: list[Access] = []
        if self._names:
            accesses.append(card.start_access())
        accesses.append(card.output_access(wiring.output, int(wave.codes[k])))
        lines = self._lines_at(k)
        if lines != card.lines:
            accesses.append(card.lines_access(lines))
        if wiring.clocking is SampleClock.PULSE and wiring.clock is not None:
            accesses.append(card.lines_access(lines & ~(1 << wiring.clock)))
        accesses.append(card.state_access())
        state = card.registers.batch(accesses)[-1]
        self._position = k + 1
        schedule.written()
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
