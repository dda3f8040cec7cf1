"""A waveform on an NI card: buffered, on the card's own sample clock.

The clock and the start are exported, so that an interferometer can sample with them, and the
monitors are read on the same clock. Never run on NI's driver; see `hardware.devices.daq.ni`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Clock, Identity, WallClock, WaveProgress
from hardware.devices.amplifier.data import Amplifier
from hardware.devices.daq.ni import NiChannel, NiTimedInputs, clocked, translated
from hardware.errors import HardwareError, ProtocolFault, TimedOut

REPORT = 0.02
_UNITS = {"V": "V", "V_mon": "V", "i": "A"}


@dataclass(frozen=True, slots=True)
class NiTerminals:
    """What is connected to the card beside the output.

    Parameters
    ----------
    monitors : tuple of str
        Inputs of the monitors, such as ``"Dev1/ai0"``, in the order of
        ``amplifier.monitors.channels()``.
    clock : str
        Terminal to export the sample clock to, such as ``"/Dev1/PFI0"``.
    start : str
        Terminal to export the start trigger to.
    trigger : str
        Terminal whose rising edge starts the output; empty to start at once.
    """

    monitors: tuple[str, ...] = ()
    clock: str = ""
    start: str = ""
    trigger: str = ""


@final
class NiWave:
    """Plays waveforms through an NI card and an amplifier; unguarded.

    The monitors are sampled at the edge that updates the output, so a reading belongs to the
    voltage just before its own sample.

    Parameters
    ----------
    channel : NiChannel
        The output.
    amplifier : Amplifier
        Between volts at the actuator and volts of the card.
    terminals : NiTerminals, optional
        What is connected.
    clock : Clock, optional
        For waiting between reports.
    timeout : float
        Longest time without a new sample (s).
    """

    def __init__(
        self,
        channel: NiChannel,
        amplifier: Amplifier,
        terminals: NiTerminals | None = None,
        *,
        clock: Clock | None = None,
        timeout: float = 5.0,
    ) -> None:
        self._channel = channel
        self._amplifier = amplifier
        self._terminals = NiTerminals() if terminals is None else terminals
        self._clock: Clock = WallClock() if clock is None else clock
        self._timeout = timeout
        self._names = amplifier.monitored(self._terminals.monitors)
        self._monitors = NiTimedInputs(
            self._terminals.monitors, f"/{channel.device}/ao/SampleClock"
        )
        self._volts: NDArray[np.float64] = np.zeros(0)
        self.rate = 0.0
        self._task: Any = None
        self._total = 0
        self._running = False
        self._ending = False
        self._position: int | None = 0

    @property
    def identity(self) -> Identity:
        """The card."""
        return self._channel.identity

    @property
    def position(self) -> int | None:
        """Samples of the last waveform that were put out, while it plays and after `abort`.

        None after a waveform was broken off and the driver no longer tells how far it was once the
        card had stopped: what it told before is too little by what was put out until then.
        """
        task, least = self._task, self._position
        if task is None or least is None:
            return least
        told = _generated(task)
        return least if told is None else max(least, min(told, self._total))

    def load(self, volts: NDArray[np.float64], rate: float) -> None:
        """Check a waveform (V at the actuator, ``(n,)``) and keep it; the card is not touched."""
        record = np.array(volts, float)
        if record.ndim != 1 or record.size < 2 or not 0.0 < rate < 1e8:
            raise UnusableInput(
                f"waveform of shape {record.shape} at {rate} Hz; give at least 2 samples and a "
                "rate > 0"
            )
        inputs = self._amplifier.input_record(record)
        if inputs.min() < self._channel.lowest or inputs.max() > self._channel.highest:
            raise UnusableInput(
                f"{self._channel.name}: needs {inputs.min():g} to {inputs.max():g} V; it gives "
                f"{self._channel.lowest:g} to {self._channel.highest:g} V"
            )
        self._volts, self.rate = record, rate

    def play(self) -> Iterator[WaveProgress]:
        """Play on the card; yields about every 20 ms."""
        if self._volts.size == 0:
            raise ProtocolFault("no waveform is loaded; call load() first")
        self._position = 0
        return self._play(self._volts, self.rate)

    def abort(self) -> None:
        """Stop; the output keeps its value. Never raises."""
        task, self._ending = self._task, True
        if task is not None:
            before, least = _generated(task), self._position
            if before is not None and least is not None:
                # also for whoever comes again after an interrupt, when the driver has forgotten
                self._position = least = max(least, min(before, self._total))
            try:
                task.stop()
                # only what stands still can be counted
                after = _generated(task)
            except Exception:
                after = None
            # not before: whoever interrupts it has to find the task again
            self._task = None
            with suppress(Exception):
                task.close()
            if self._running and self._position != self._total:
                told = None if before is None or least is None else after
                self._position = told if told is not None and told >= (least or 0) else None
        self._monitors.stop()

    def _play(self, volts: NDArray[np.float64], rate: float) -> Iterator[WaveProgress]:
        total = volts.size
        reported, since = 0, self._clock.now()
        readings = np.zeros((len(self._names), 0))
        try:
            self._start(volts, rate)
            while reported < total:
                self._clock.sleep(REPORT)
                if self._ending:
                    return
                generated, readings = self._progress(readings)
                count = min(generated, reported + readings.shape[1]) if self._names else generated
                if count > reported:
                    since = self._clock.now()
                    new = count - reported
                    chunk = self._chunk(reported, volts[reported:count], readings[:, :new])
                    readings = readings[:, new:]
                    reported = count
                    yield WaveProgress(reported, total, 0, (chunk,))
                elif self._clock.now() - since > self._timeout:
                    raise TimedOut(
                        f"{self._channel.name}: no new sample within {self._timeout:g} s after "
                        f"{reported} of {total}; does the start trigger come?"
                    )
                else:
                    yield WaveProgress(reported, total)
        except HardwareError as error:
            left = readings.shape[1]
            if left and error.partial is None:
                error.carrying(
                    (self._chunk(reported, volts[reported : reported + left], readings),)
                )
            raise
        finally:
            self.abort()

    def _start(self, volts: NDArray[np.float64], rate: float) -> None:
        """Prepare the output, arm the inputs, start the output last: it gives the clock."""
        self._channel.release()
        terminals = self._terminals
        with translated(f"{self._channel.name} waveform") as nidaqmx:
            kinds = nidaqmx.constants
            task = nidaqmx.Task()
            self._task, self._total, self._running = task, volts.size, False
            self._ending = False
            self._channel.add_to(task)
            clocked(task, kinds, rate, volts.size, trigger=terminals.trigger)
            for signal, terminal in (
                (kinds.Signal.SAMPLE_CLOCK, terminals.clock),
                (kinds.Signal.START_TRIGGER, terminals.start),
            ):
                if terminal:
                    task.export_signals.export_signal(signal, terminal)
            written = task.write(self._amplifier.input_record(volts), auto_start=False)
            if written != volts.size:
                raise ProtocolFault(
                    f"{self._channel.name}: the driver took {written} of {volts.size} samples"
                )
            if self._names:
                self._monitors.start(rate, volts.size)
            self._running = True
            task.start()

    def _progress(self, readings: NDArray[np.float64]) -> tuple[int, NDArray[np.float64]]:
        """Return how many samples were put out, and the readings that wait to be reported."""
        with translated(f"{self._channel.name} waveform"):
            finished = bool(self._task.is_task_done())
            generated = int(self._task.out_stream.total_samp_per_chan_generated)
        position = self._total if finished else min(generated, self._total)
        self._position = position
        if self._names:
            readings = np.concatenate([readings, self._monitors.drain()], axis=1)
        return position, readings

    def _chunk(
        self, first: int, volts: NDArray[np.float64], readings: NDArray[np.float64]
    ) -> Chunk:
        channels = {"V": volts}
        for name, raw in zip(self._names, readings, strict=True):
            channels[name] = self._amplifier.monitors.scaled(name, raw)
        return Chunk("output", first, channels, {k: _UNITS[k] for k in channels})


def _generated(task: Any) -> int | None:
    """Return how many samples were put out; None if the driver does not tell."""
    with suppress(Exception):
        return int(task.out_stream.total_samp_per_chan_generated)
    return None
