"""A device behind a link that may break at any byte, a program that may be interrupted anywhere."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Chunk, Identity, WaveProgress
from hardware.errors import LinkLost


class Interrupts:
    """Ctrl-C at the n-th place where a program can be caught."""

    def __init__(self) -> None:
        self.left: int | None = None

    def place(self) -> None:
        if self.left is None:
            return
        self.left -= 1
        if self.left < 0:
            self.left = None
            raise KeyboardInterrupt


class TrueTime:
    """A virtual clock: sleeping passes true time; the reading can be set forward and back.

    `visits` are called one a sleep: what another thread or a signal handler does meanwhile.
    """

    def __init__(self, interrupts: Interrupts | None = None) -> None:
        self.true = 0.0
        self.jump = 0.0
        self.interrupts = interrupts or Interrupts()
        self.device: Device | None = None
        self.visits: list[Callable[[], None]] = []

    def now(self) -> float:
        return self.true + self.jump

    def sleep(self, seconds: float) -> None:
        self.interrupts.place()
        if seconds > 0.0:
            self.true += seconds
            if self.device is not None:
                self.device.time_passed(seconds)
        if self.visits:
            self.visits.pop(0)()
        self.interrupts.place()


class Device:
    """What is at the far end of the link; keeps a record of everything that reached it.

    `steps` holds time, voltage before, voltage after and the cause of every change.
    """

    def __init__(self, clock: TrueTime, watchdog: float = 0.0) -> None:
        self.clock = clock
        clock.device = self
        self.volts = 0.0
        self.steps: list[tuple[float, float, float, str]] = []
        self.watchdog = watchdog
        self.silence = 0.0
        self.reachable = True
        self.linked = False
        self.budget: int | None = None
        self.unnoticed = False

    def move(self, volts: float, cause: str) -> None:
        self.steps.append((self.clock.true, self.volts, volts, cause))
        self.volts = volts

    def time_passed(self, seconds: float) -> None:
        self.silence += seconds
        if self.watchdog and self.silence > self.watchdog and self.volts != 0.0:
            self.move(0.0, "watchdog")

    def power_cycle(self) -> None:
        self.move(0.0, "power")
        self.linked = False
        self.budget = None
        self.unnoticed = True

    def connect(self) -> None:
        self.unnoticed = False
        if not self.reachable:
            raise LinkLost("device: nobody answers; check the cable")
        self.linked = True

    def carry(self, data: bytes) -> bool:
        """Pass bytes; False (and a dead link) if not all of them arrive."""
        if not self.linked or not self.reachable:
            self.linked = False
            return False
        if self.budget is not None:
            if self.budget < len(data):
                self.linked, self.budget = False, None
                return False
            self.budget -= len(data)
        return True

    def command(self, volts: float, cause: str) -> None:
        """One command and its answer."""
        self.unnoticed = False
        # a command counts only with its end; its answer may be lost after it was carried out
        if not self.carry(f"SVA {volts!r}\n".encode()):
            raise LinkLost("device: the link ended within a command")
        self.silence = 0.0
        self.move(volts, cause)
        if not self.carry(b"0\n"):
            raise LinkLost("device: the link ended within an answer")


class RawDevice:
    """`RawOutput` of the device."""

    identity = Identity("Test", "device", "1", "")

    def __init__(self, device: Device, can_read: bool = True) -> None:
        self.device = device
        self.can_read = can_read
        self.closed = 0

    @property
    def has_watchdog(self) -> bool:
        return self.device.watchdog > 0.0

    def power_up(self) -> None:
        self.device.clock.interrupts.place()
        self.device.connect()
        self.device.command(0.0, "power-up")
        self.device.clock.interrupts.place()

    def write(self, volts: float) -> None:
        self.device.clock.interrupts.place()
        self.device.command(volts, "write")
        self.device.clock.interrupts.place()

    def read(self) -> float | None:
        if not self.can_read:
            return None
        self.device.clock.interrupts.place()
        if not self.device.linked:
            self.device.connect()
        if not self.device.carry(b"VOL?\n") or not self.device.carry(b"12.345\n"):
            raise LinkLost("device: the link ended within a question")
        return self.device.volts

    def close(self) -> None:
        self.closed += 1


class FedDevice(RawDevice):
    """The same with a watchdog that wants food."""

    fed = 0

    @property
    def watchdog_timeout(self) -> float:
        return self.device.watchdog

    def feed_watchdog(self) -> None:
        if not self.device.carry(b"LIFE\n"):
            raise LinkLost("device: no sign of life arrived")
        self.fed += 1
        self.device.silence = 0.0


class RawPlayer:
    """`RawWave` of the device, sample by sample."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.volts = np.zeros(0)
        self.rate = 1.0
        self.loads = 0
        self.aborted = 0
        self.running = False
        self.written = 0

    def load(self, volts: NDArray[np.float64], rate: float) -> None:
        self.volts, self.rate = volts, rate
        self.loads += 1
        if not self.device.carry(b"WAV\n"):
            raise LinkLost("device: the waveform did not arrive")

    def play(self) -> Iterator[WaveProgress]:
        self.written, self.running = 0, True
        block = max(round(0.02 * self.rate), 1)
        while self.running and self.written < self.volts.size:
            first = self.written
            for v in self.volts[first : first + block]:
                if self.stopped():
                    return
                self.device.clock.interrupts.place()
                self.device.command(float(v), "wave")
                self.device.clock.interrupts.place()
                self.written += 1
                self.device.clock.sleep(1.0 / self.rate)
            chunk = Chunk("output", first, {"V": self.volts[first : self.written]}, {"V": "V"})
            yield WaveProgress(self.written, self.volts.size, 0, (chunk,))

    def stopped(self) -> bool:
        return not self.running

    def abort(self) -> None:
        self.aborted += 1
        self.running = False


class TellingPlayer(RawPlayer):
    """The same, and tells how far it really came."""

    @property
    def position(self) -> int:
        return self.written


def unsafe(device: Device, low: float, high: float, largest: float) -> list[str]:
    """Everything the guard let through that it should not have."""
    slack = 1e-6
    found = []
    for time, before, after, cause in device.steps:
        if not math.isfinite(after) or not low - slack <= after <= high + slack:
            found.append(f"{cause} at {time:.6f} s: {after} V")
        if cause in ("write", "wave") and not abs(after - before) <= largest + slack:
            found.append(f"{cause} at {time:.6f} s: step {before} -> {after} V")
    return found
