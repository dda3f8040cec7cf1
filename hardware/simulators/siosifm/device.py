"""The simulated interferometer itself: what its electronics answer to the library."""

from __future__ import annotations

import struct
from collections import deque
from typing import final

import numpy as np

from hardware.simulators.rig import DeviceClock, Rig
from hardware.simulators.siosifm.condition import Answer, Condition
from hardware.simulators.siosifm.counter import OVERFLOW_DEVICE, OVERFLOW_LIBRARY, Counter
from hardware.simulators.siosifm.run import CLOCK, EVENT, START, Edges, MeasurementRun

CHANNEL, DATALEN, REQUEST, USB, NOT_IMPLEMENTED, TOO_FAST, PARAMETER = (
    -2, -4, -11, -12, -100, -18, -22,
)  # fmt: skip
MEMORY = 32_768
FILTER_USER = 0x2000
BASE = 50e6


@final
class SimulatedInterferometer(Condition):
    """One device, one channel.

    Parameters
    ----------
    rig : Rig
        The bench.
    clock : DeviceClock
        The device's clock.
    counter : Counter
        Its beam.
    serial : int
        Number on the bus.
    stream_limit, block_limit : float
        Largest rates of streaming and of blocks (Hz); more is refused with -18.
    clocked_blocks : bool
        Whether edges can clock a block; if not, such a block is refused with -22.
    starts, clocks : callable
        ``starts(first)`` gives the true instants (s) of the edges on the start input but for the
        first so many; `clocks` the same for the clock or event input.
    """

    def __init__(
        self,
        rig: Rig,
        clock: DeviceClock,
        counter: Counter,
        *,
        serial: int,
        stream_limit: float,
        block_limit: float,
        clocked_blocks: bool,
        starts: Edges,
        clocks: Edges,
    ) -> None:
        super().__init__(rig, counter, serial)
        self.requests: deque[str] = deque(maxlen=400)
        self._clock = clock
        self._limits = stream_limit, block_limit
        self._clocked_blocks = clocked_blocks
        self._starts, self._clocks = starts, clocks
        self._trigger = 0
        self._flags, self._rate = 0x0102, 1000.0
        self._block = (0x0102, 0, 1000.0)
        self._run: MeasurementRun | None = None
        self._length = self._sent = 0
        self._memory = b""
        self._dead_path = self._preset = 0.0
        self._averages = self._average = 1

    def answer(self, line: str) -> Answer:
        """Answer one request of the library."""
        word, *rest = line.split()
        if word not in ("FETCH", "READY", "STATUS"):
            self.requests.append(line)
        method = getattr(self, f"_do_{word.lower()}", None)
        if method is None:
            return NOT_IMPLEMENTED, b""
        result: Answer | int = method(*rest)
        return (result, b"") if isinstance(result, int) else result

    # ---- identity

    def _do_open(self, how: str, number: str) -> int:
        self._run = None
        return 0 if how != "USB" or number == "0" else USB

    def _do_close(self) -> int:
        self._run = None
        return 0

    def _do_info(self, number: str, part: str) -> int:
        now = self._rig.now
        if self.counter.faults.stale_air and self.counter.sensors_stopped is not None:
            now = self.counter.sensors_stopped
        values = {
            1: int(self._rate), 2: int(self._rate), 4: self._flags, 5: self._trigger,
            8: 1, 9: self._serial, 11: 1, 22: 0, 23: 0,
            24: int(self.counter.ellipse_fit), 30: int(now) + 1, 34: 0, 35: 0,
        }  # fmt: skip
        return values.get(int(number), REQUEST)

    def _do_setinfo(self, number: str, value: str) -> int:
        if number != "24":
            return REQUEST
        self.counter.ellipse_fit = value != "0"
        return 0

    def _do_number(self, number: str) -> Answer | int:
        shape = self.counter.shape
        values = {
            14: self._rate, 21: self._rate,
            25: shape.offset_cosine * shape.amplitude, 26: shape.offset_sine * shape.amplitude,
            27: shape.phase, 28: shape.ratio, 29: shape.amplitude,
        }  # fmt: skip
        if int(number) not in values:
            return REQUEST
        return 0, struct.pack("<d", values[int(number)])

    # ---- settings

    def _do_trigger(self, mode: str) -> int:
        self._trigger = int(mode)
        return 0

    def _do_filter(self, flags: str, first: str, second: str) -> int:
        if int(first) < 0 or int(second) < 0:
            return PARAMETER
        self._averages = max(int(first), 1) * max(int(second), 1)
        return 0

    def _do_measure(self, flags: str, rate: str) -> int:
        asked = float(rate)
        average = self._averages if int(flags) & FILTER_USER else 1
        if asked * average > self._limits[0] * (1.0 + 1e-9):
            return TOO_FAST
        if not asked > 0.0:
            return PARAMETER
        self._average = average
        self._flags, self._rate, self._run = int(flags), _steps(asked), None
        return 0

    def _do_deadpath(self, channel: str, mm: str) -> int:
        if channel != "0" or int(mm) < 0:
            return CHANNEL if channel != "0" else PARAMETER
        self.counter.settings.dead_path = 1e-3 * int(mm)
        return 0

    def _do_getdeadpath(self, channel: str) -> int:
        return round(1e3 * self._dead_path)

    def _do_preset(self, channel: str, nm: str) -> int:
        self.counter.settings.preset = 1e-9 * float(nm)
        return 0 if channel == "0" else CHANNEL

    def _do_getpreset(self, channel: str) -> Answer:
        return 0, struct.pack("<d", 1e9 * self._preset)

    def _do_refmirror(self, channel: str, on: str) -> int:
        self.counter.settings.mirror = on != "0"
        return 0 if channel == "0" else CHANNEL

    def _do_zero(self, mask: str) -> int:
        self.counter.zero()
        self._dead_path = self.counter.settings.dead_path
        self._preset = self.counter.settings.preset
        self._lost = 0
        return 0

    # ---- measuring

    def _do_start(self) -> int:
        self._arm(self._rate, self._trigger)
        return 0

    def _do_stop(self) -> int:
        self._run = None
        return 0

    def _do_clear(self) -> int:
        if self._run is not None:
            missed = self._run.due(self._rig.now) - self._sent
            self.counter.skip(missed)
            self._sent += missed
        return 0

    def _do_fetch(self, room: str) -> Answer:
        run = self._run
        if run is None or self._length:
            return 0, b""
        due = run.due(self._rig.now)
        count = min(due - self._sent, int(room))
        data = self._rows(run, count)
        dropped = due - self._sent
        if dropped > 0:  # nobody fetched in time and the buffer of the library is full
            self.counter.skip(dropped)
            self.counter.status |= OVERFLOW_LIBRARY
            self._sent += dropped
            self._lost += dropped
        return count, data

    def _do_blockmode(self, flags: str, trigger: str, rate: str) -> int:
        average = self._averages if int(flags) & FILTER_USER else 1
        if float(rate) * average > self._limits[1]:
            return TOO_FAST
        if int(rate) <= 0:
            return PARAMETER
        if int(trigger) & (CLOCK | EVENT) and not self._clocked_blocks:
            return PARAMETER
        self._average = average
        self._block = int(flags), int(trigger), _steps(float(rate))
        self._flags, self._rate, self._run = int(flags), self._block[2], None
        return 0

    def _do_block(self, length: str) -> int:
        if not 0 < int(length) <= MEMORY:
            return DATALEN
        self._arm(self._block[2], self._block[1])
        self._length = int(length)
        return 0

    def _do_ready(self) -> int:
        run = self._run
        if run is None or not self._length:
            return 0
        due = min(run.due(self._rig.now), self._length)
        self._memory += self._rows(run, due - self._sent)
        return int(due == self._length)

    def _do_take(self, room: str) -> Answer:
        data, self._memory = self._memory, b""
        self._run, self._length = None, 0
        return 1, data

    def _do_cancel(self) -> int:
        self._run, self._length = None, 0
        return 0

    def _arm(self, rate: float, mode: int) -> None:
        f = self.counter.faults
        if f.no_trigger:
            mode |= START
        self._run = MeasurementRun(
            self._clock, rate, mode, self._rig.now,
            (lambda first: ()) if f.no_trigger else self._starts,
            self._clocks, f.late_samples / rate,
        )  # fmt: skip
        self._length = self._sent = 0
        self._memory = b""

    def _rows(self, run: MeasurementRun, count: int) -> bytes:
        """Take the next samples; those in an overrun are counted but do not arrive."""
        if count <= 0:
            return b""
        first = self._sent
        self._sent += count
        instants = np.minimum(run.instants(first, count), self._rig.now)
        if run.external:
            own = (instants - run.armed) / (1.0 + 1e-6 * self._clock.ppm)
        else:
            own = (first + np.arange(count)) / run.rate
        try:
            rows = self.counter.rows(instants, first, own, self._average, 1.0 / run.rate)
        except ValueError:  # nobody fetched for longer than the rig remembers
            self.counter.skip(count)
            self.counter.status |= OVERFLOW_DEVICE
            self._lost += count
            return b""
        f = self.counter.faults
        if f.overrun_at is not None:
            number = first + np.arange(count)
            lost = (number >= f.overrun_at) & (number < f.overrun_at + f.overrun_samples)
            self._lost += int(lost.sum())
            rows = rows[~lost]
        return rows.tobytes()


def _steps(rate: float) -> float:
    """Nearest rate that divides the device's base clock."""
    return BASE / max(round(BASE / rate), 1)
