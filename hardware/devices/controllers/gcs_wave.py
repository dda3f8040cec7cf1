"""Waveforms by the controller's wave generator: timed in the device, not by the program.

The generator's start mode 1, the trigger mode 4 of ``CTO`` and the meaning of ``#9`` are known from
public documents only.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Flag, WaveProgress
from hardware.devices.controllers.gcs_controller import GcsController, differ
from hardware.devices.controllers.gcs_errors import UNKNOWN, forgiven
from hardware.errors import HardwareError, LimitViolation, Overrun, ProtocolFault, TimedOut

_GENERATOR_TRIGGER = 4
_REPORT = 0.02
_SLACK = 0.01


@final
class GcsWave:
    """The wave generator of one axis.

    Values are put out every whole number of servo periods, so a rate must be the servo rate by a
    whole number. When it ends the output keeps the last value.

    Parameters
    ----------
    controller : GcsController
        The axis, open loop.
    trigger_line : int, optional
        Digital output that gives an edge with the first value. Without it the start is only known
        to about the time of one question and its answer, and all samples carry
        ``Flag.UNSYNCHRONISED``.
    """

    def __init__(self, controller: GcsController, trigger_line: int | None = 1) -> None:
        self._controller = controller
        self._line = trigger_line
        self._volts: NDArray[np.float64] = np.zeros(0)
        self.rate = 0.0
        self._position: int | None = 0
        self._playing = False

    @property
    def position(self) -> int | None:
        """Samples of the last waveform that were put out; 0 before it, all of them after its end.

        None while it plays, and after it was broken off: GCS has no question for the point at which
        the generator stood still (``WGN?`` counts whole cycles), and the time between a command and
        its effect is unknown. Read the output back then (`GcsController.read`).
        """
        return self._position

    def load(self, volts: NDArray[np.float64], rate: float) -> None:
        """Load a waveform (V, (n,)) at a rate (Hz).

        Raises
        ------
        UnusableInput
            If the generator cannot play at this rate; the nearest one is named.
        ProtocolFault
            If a waveform is playing: the table belongs to the device, which reads it.
        LimitViolation
            If a value is not finite.
        Overrun
            If it is longer than the wave table.
        """
        wave = np.array(volts, dtype=np.float64)
        address = self._controller.talk.address
        if wave.ndim != 1 or wave.size == 0 or not np.all(np.isfinite(wave)):
            raise LimitViolation(f"{address}: a waveform needs finite voltages (n,); nothing sent")
        if self._playing:
            raise ProtocolFault(
                f"{address}: a waveform is playing; abort it before loading another"
            )
        divider = self._controller.divider(rate, "play")
        room = self._room()
        if room is not None and wave.size > room:
            raise Overrun(f"{address}: {wave.size} samples do not fit the wave table ({room})")
        self._volts = np.zeros(0)
        self._send_table(wave)
        self._arm(divider)
        wave.setflags(write=False)
        self._volts, self.rate = wave, self._controller.servo_rate() / divider
        self._position = 0

    def play(self) -> Iterator[WaveProgress]:
        """Play it; yields about every 20 ms and at the end.

        Raises
        ------
        ProtocolFault
            If the device stops before the end, with the last `WaveProgress` as `partial`.
        TimedOut
            If it does not stop, likewise; the generator is stopped then.
        """
        if not self._volts.size:
            raise UnusableInput(f"{self._controller.talk.address}: load a waveform before playing")
        self._position = 0
        return self._play(self._volts, self.rate)

    def _play(self, volts: NDArray[np.float64], rate: float) -> Iterator[WaveProgress]:
        c, total = self._controller, volts.size
        length = total / rate
        reported, runs = 0, True
        self._playing, self._position = True, None
        try:
            start = self._start()
            while runs:
                c.clock.sleep(_REPORT)
                runs = c.wave_runs()
                elapsed = c.clock.now() - start
                done = min(int(elapsed * rate) + 1, total)
                if not runs and elapsed < length * (1.0 - _SLACK) - _REPORT:
                    raise ProtocolFault(
                        f"{c.talk.address}: the generator stopped after about {done} of {total} "
                        "samples; stopped at the device, or by its watchdog",
                        self._report(volts, rate, start, reported, done),
                    )
                if runs and elapsed > length * (1.0 + _SLACK) + 1.0:
                    raise TimedOut(
                        f"{c.talk.address}: the generator still runs after {elapsed:.3g} s of "
                        f"{length:.3g} s",
                        self._report(volts, rate, start, reported, done),
                    )
                if not runs:
                    self._require_end(volts, self._report(volts, rate, start, reported, done))
                    self._position = total
                done = total if not runs else min(done, total - 1)
                report = self._report(volts, rate, start, reported, done)
                reported = max(done, reported)
                yield report
        finally:
            self._playing = False
            if runs:
                self.abort()

    def _require_end(self, volts: NDArray[np.float64], report: WaveProgress) -> None:
        """Refuse an end at which the output does not stand at the last sample.

        A stop shortly before it cannot be told from it by the time.
        """
        c, last = self._controller, float(volts[-1])
        measured = c.measured()
        if measured is not None and differ(measured, last):
            raise ProtocolFault(
                f"{c.talk.address}: the generator stopped at {measured:g} V where the waveform "
                f"ends at {last:g} V; stopped at the device, or by its watchdog",
                report,
            )

    def _start(self) -> float:
        """Start the generator; return about when it did (s)."""
        c = self._controller
        before = c.clock.now()
        try:
            c.talk.send(f"WGO {c.setup.generator} 1")
        except LimitViolation:
            # refused by the device: nothing was put out
            self._position = 0
            raise
        return 0.5 * (before + c.clock.now())

    def abort(self) -> None:
        """Stop the generator, if need be everything; the voltage stays. Never raises."""
        try:
            self._controller.stop_wave()
        except HardwareError:
            try:
                self._controller.stop()
            except HardwareError:
                pass  # the link is gone; the guard says that the output is unknown

    def _room(self) -> int | None:
        """Points of the wave table; None where the controller cannot tell."""
        c = self._controller
        return forgiven(UNKNOWN, lambda: c.integer(f"WMS? {c.setup.table}"))

    def _send_table(self, wave: NDArray[np.float64]) -> None:
        c = self._controller
        table, piece = c.setup.table, c.setup.arguments - 5
        values = [f"{c.control_value(float(v)):.6f}" for v in wave]
        mode = "X"
        for k in range(0, len(values), piece):
            part = values[k : k + piece]
            c.talk.send(f"WAV {table} {mode} PNT 1 {len(part)} {' '.join(part)}")
            mode = "&"
        stored = c.integer(f"WAV? {table} 1")
        if stored != wave.size:
            raise ProtocolFault(
                f"{c.talk.address}: {stored} of {wave.size} samples in wave table {table}", stored
            )

    def _arm(self, divider: int) -> None:
        c = self._controller
        generator = c.setup.generator
        for command in (
            f"WSL {generator} {c.setup.table}",
            f"WGC {generator} 1",
            f"WTR {generator} {divider} 0",
        ):
            c.talk.send(command)
        if self._line is not None:
            c.talk.send("TWC")
            c.talk.send(f"CTO {self._line} 3 {_GENERATOR_TRIGGER}")
            c.talk.send(f"TWS {self._line} 1 1 {self._line} 2 0")

    def _report(
        self, volts: NDArray[np.float64], rate: float, start: float, first: int, done: int
    ) -> WaveProgress:
        total = volts.size
        if done <= first:
            return WaveProgress(first, total)
        k = np.arange(first, done)
        flag = Flag.UNSYNCHRONISED if self._line is None else Flag.GOOD
        chunk = Chunk(
            "output",
            first,
            {"V": volts[first:done], "instant": start + k / rate},
            {"V": "V", "instant": "s"},
            np.full(k.size, int(flag), np.uint16),
        )
        return WaveProgress(done, total, 0, (chunk,))
