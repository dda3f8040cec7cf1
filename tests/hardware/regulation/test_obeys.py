"""Whatever a controller asks for and a sensor does, the actuator sees what its envelope allows."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Flag, Identity
from hardware.envelope import Envelope, GuardedOutput, OutputState, parked
from hardware.errors import BeamLost, HardwareError, LinkLost
from hardware.regulation import LOOP, LoopPlan, LoopStation, regulate
from tests.hardware.envelope.device import Device, FedDevice, Interrupts, RawDevice, TrueTime
from tests.hardware.envelope.test_state_machine import ENVELOPES

STRANGE = (math.nan, math.inf, -math.inf, 1e308, -1e308)


class Notes:
    """A journal in memory."""

    def __init__(self) -> None:
        self.chunks: list[Chunk] = []
        self.events: list[Mapping[str, Any]] = []

    def append(self, chunk: Chunk) -> None:
        self.chunks.append(chunk)

    def note(self, event: Mapping[str, Any]) -> None:
        self.events.append(event)


class WildSensor:
    """Gives readings, or none, or is lost; the program may stand still meanwhile."""

    stream, rate, identity, done = "wild", 1e5, Identity("Test", "sensor"), False

    def __init__(self, rng: np.random.Generator, clock: TrueTime, trouble: float) -> None:
        self.rng, self.clock, self.trouble = rng, clock, trouble
        self.count = self.aborted = 0

    def kickoff(self) -> None:
        pass

    def poll(self) -> Sequence[Chunk]:
        self.clock.interrupts.place()
        fate = self.rng.random() if self.count > 45 else 1.0
        if fate < self.trouble:
            kind = self.rng.integers(6)
            if kind == 0:
                raise BeamLost("wild: no light", [self.chunk(0.0)])
            if kind == 1:
                raise LinkLost("wild: the cable is out")
            if kind == 2:
                return [self.chunk(float(self.rng.choice(STRANGE[:3])))]
            if kind == 3:
                return [self.chunk(0.0, int(Flag.BEAM_LOST))]
            if kind == 4:
                self.clock.sleep(float(self.rng.choice([0.003, 0.03, 0.5])))
            else:
                return []
        return [self.chunk(float(self.rng.normal()))]

    def chunk(self, value: float, flags: int = 0) -> Chunk:
        self.count += 1
        return Chunk(
            "wild", self.count - 1, {"x": np.array([value])}, {"x": "m"},
            np.array([flags], np.uint16),
        )  # fmt: skip

    def finish(self) -> Sequence[Chunk]:
        return []

    def abort(self) -> None:
        self.aborted += 1


class WildController:
    """Any numbers, now and then none; keeps what was really applied."""

    def __init__(self, rng: np.random.Generator, envelope: Envelope, strange: float) -> None:
        self.rng, self.strange, self.last = rng, strange, envelope.safe
        self.reach = 3.0 * (envelope.v_max - envelope.v_min)

    def begin(self, reading: float, volts: float) -> None:
        assert math.isfinite(reading)
        self.last = volts

    def decide(self, reading: float, reference: float) -> float:
        assert math.isfinite(reading)
        if self.rng.random() < self.strange:
            return float(self.rng.choice(STRANGE))
        wide = self.rng.random() < 0.5
        size = self.reach if wide else 0.02 * self.reach
        return self.last + float(self.rng.uniform(-size, size))

    def applied(self, volts: float) -> None:
        self.last = volts


def one_run(seed: int) -> str:
    """Run a loop with the misfortunes of a seed; return how it ended."""
    rng = np.random.default_rng(seed)
    interrupts = Interrupts()
    clock = TrueTime(interrupts)
    watchdog = float(rng.choice([0.0, 0.0, 0.3]))
    device = Device(clock, watchdog)
    envelope = ENVELOPES[seed % len(ENVELOPES)]
    raw = (FedDevice if watchdog else RawDevice)(device, bool(rng.integers(2)))
    output = GuardedOutput(raw, envelope, clock)
    sensor = WildSensor(rng, clock, float(rng.choice([0.0, 0.01, 0.1])))
    bench = LoopStation(
        clock, output, sensor, 1.0 / envelope.update_period, "the envelope", safety=parked(output)
    )
    rate = float(rng.uniform(0.05, 1.0)) / envelope.update_period
    plan = LoopPlan(np.zeros(60), rate, start=float(rng.choice([envelope.safe, 30.0])), settle=0.0)
    controller = WildController(rng, envelope, float(rng.choice([0.0, 0.003, 0.1])))
    if rng.random() < 0.2:
        device.budget = int(rng.integers(20_000))
    if rng.random() < 0.2:
        interrupts.left = int(rng.integers(3000))
    notes, ended = Notes(), "whole"
    try:
        timing = regulate(bench, plan, controller, notes)
        assert timing.ticks + timing.missed == 60
    except (HardwareError, KeyboardInterrupt) as error:
        ended = type(error).__name__
    interrupts.left = None
    judge(device, envelope, output, notes)
    assert sensor.aborted
    with suppress(HardwareError):
        output.close()
    return ended


def judge(device: Device, envelope: Envelope, output: GuardedOutput, notes: Notes) -> None:
    """Hold every change that reached the device against the envelope."""
    assert output.state is not OutputState.DRIVEN
    if output.state is OutputState.PARKED:
        assert device.volts == envelope.safe
    before = -math.inf
    for time, old, new, cause in device.steps:
        # the device itself comes up at 0 V
        assert min(envelope.v_min, 0.0) - 1e-6 <= new <= envelope.v_max + 1e-6, (time, new, cause)
        if cause == "write":
            assert abs(new - old) <= envelope.largest_step(old, new) + 1e-6, (time, old, new)
            # and no two within one update period, by which slew and current are judged
            if new != old:
                assert time - before >= envelope.update_period * (1.0 - 1e-6), time
                before = time
    told = [c for c in notes.chunks if c.stream == LOOP]
    for chunk in told:
        v = chunk.channels["V"]
        assert ((v >= envelope.v_min) & (v <= envelope.v_max)).all()


def ends_of(runs: int) -> Counter[str]:
    return Counter(one_run(seed) for seed in range(runs))


def test_no_loop_leaves_the_envelope() -> None:
    ends = ends_of(400)
    # the misfortunes are real ones: of every kind some loops ended by it, and some came through
    assert {
        "whole",
        "BeamLost",
        "LinkLost",
        "TimedOut",
        "LimitViolation",
        "KeyboardInterrupt",
    } <= set(ends)
    assert ends["whole"] > 40


@pytest.mark.long
def test_no_loop_of_ten_thousand_leaves_the_envelope() -> None:
    assert ends_of(10_000)["whole"] > 1000


def test_a_rate_beyond_the_envelope_moves_nothing() -> None:
    clock = TrueTime()
    device = Device(clock)
    envelope = ENVELOPES[1]
    output = GuardedOutput(RawDevice(device), envelope, clock)
    sensor = WildSensor(np.random.default_rng(1), clock, 0.0)
    bench = LoopStation(clock, output, sensor, 1.0 / envelope.update_period, "the envelope")
    controller = WildController(sensor.rng, envelope, 0.0)
    with pytest.raises(UnusableInput, match=r"2 kHz .* the envelope allows 1 kHz"):
        regulate(bench, LoopPlan(np.zeros(9), 2e3), controller, Notes())
    assert device.steps == []
