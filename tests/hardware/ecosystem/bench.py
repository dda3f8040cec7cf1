"""Devices in this process, in front of a rig on virtual time."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from hardware.contracts import Chunk, Flag, Identity, WaveProgress
from hardware.envelope import P840_1_UNIPOLAR, GuardedOutput, GuardedWave
from hardware.errors import LinkLost
from hardware.simulators.control import LocalClock
from hardware.simulators.plant_contract import PlantMotion
from hardware.simulators.rig import Rig

GAIN = 49e-9
"""m/V."""


class Spring:
    """A plant: 49 nm/V at once."""

    step = 1e-4

    def advance(self, volts: Array) -> PlantMotion:
        return PlantMotion(GAIN * volts, 0.0 * volts)


class RigOutput:
    """A raw output on the rig."""

    identity = Identity("none", "rig output", "7")
    has_watchdog = False

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.history: list[float] = []

    def power_up(self) -> None:
        self.rig.drive(0.0)

    def write(self, volts: float) -> None:
        self.history.append(volts)
        self.rig.drive(volts)

    def read(self) -> float | None:
        return self.rig.volts

    def close(self) -> None:
        pass


class RigWave:
    """A player of waveforms on the rig; it reports every 20 ms."""

    def __init__(self, rig: Rig, clock: YieldingClock) -> None:
        self.rig, self._clock = rig, clock
        self._loaded = (np.zeros(0), 1.0)
        self._going = False

    def load(self, volts: Array, rate: float) -> None:
        self._loaded = (volts, rate)

    def play(self) -> Iterator[WaveProgress]:
        volts, rate = self._loaded
        self._going = True
        per = max(int(0.02 * rate), 1)
        for first in range(0, volts.size, per):
            part = volts[first : first + per]
            for v in part:
                if not self._going:
                    return
                self.rig.drive(float(v))
                self.rig.wait(1.0 / rate)
            self._clock.sleep(0.0)
            chunk = Chunk("output", first, {"V": part}, {"V": "V"})
            yield WaveProgress(first + part.size, volts.size, chunks=(chunk,))

    def abort(self) -> None:
        self._going = False


class RigBlock:
    """An acquisition that sees the rig's displacement; 500 samples a poll at most."""

    identity = Identity("none", "rig sensor", "8")
    stream = "interferometer"

    def __init__(self, rig: Rig, samples: int, rate: float, fault: str = "") -> None:
        self.rig, self.samples, self.rate, self.fault = rig, samples, rate, fault
        self.given = 0
        self.aborted = False
        self._start = 0.0

    @property
    def done(self) -> bool:
        return self.given >= self.samples

    def kickoff(self) -> None:
        self._start = self.rig.now

    def poll(self) -> Sequence[Chunk]:
        if self.fault == "silent":
            return ()
        there = min(int((self.rig.now - self._start) * self.rate + 1e-9), self.samples)
        if there <= self.given:
            return ()
        first, self.given = self.given, there
        if self.fault == "gone" and there > self.samples // 2:
            raise LinkLost("rig sensor: cable pulled", partial=[self._chunk(first, there)])
        if self.fault == "gap" and first:
            first += 3
        return (self._chunk(first, there),)

    def finish(self) -> Sequence[Chunk]:
        return ()

    def abort(self) -> None:
        self.aborted = True

    def _chunk(self, first: int, end: int) -> Chunk:
        x = self.rig.seen(self._start + np.arange(first, end) / self.rate).x
        return Chunk(self.stream, first, {"x": x}, {"x": "m"})


class Length(NamedTuple):
    """One displacement."""

    value: float
    flags: Flag


class RigLength:
    """A displacement sensor that can be asked."""

    identity = Identity("none", "rig sensor", "8")

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.flags = Flag.GOOD
        self._zero = 0.0

    def zero(self) -> None:
        self._zero = self._now()
        self.flags = Flag.GOOD

    def read(self) -> Length:
        return Length(self._now() - self._zero, self.flags)

    def _now(self) -> float:
        return float(self.rig.seen(np.array([self.rig.now])).x[0])


class YieldingClock:
    """Virtual time; a wait lets the other threads run, for `real` seconds if that is set."""

    def __init__(self, rig: Rig) -> None:
        self._own = LocalClock(rig)
        self.real = 0.0

    def now(self) -> float:
        return self._own.now()

    def sleep(self, seconds: float) -> None:
        self._own.sleep(seconds)
        if self.real:
            time.sleep(self.real)


class Bench:
    """Rig, clock, guarded output and sensors."""

    def __init__(self, fault: str = "") -> None:
        self.rig = Rig(Spring())
        self.clock = YieldingClock(self.rig)
        self.raw = RigOutput(self.rig)
        self.output = GuardedOutput(self.raw, P840_1_UNIPOLAR, self.clock)
        self.wave = GuardedWave(self.output, RigWave(self.rig, self.clock))
        self.sensor = RigLength(self.rig)
        self.fault = fault
        self.blocks: list[RigBlock] = []

    def make(self, samples: int, rate: float) -> RigBlock:
        self.blocks.append(RigBlock(self.rig, samples, rate, self.fault))
        return self.blocks[-1]
