"""Loops on the virtual bench, over its wire."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.ultrasonic import PositionController, Sampling, StageLoop, designed
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.support.errors import UnknownName, UnusableInput
from hardware.contracts import Chunk, Flag, WallClock
from hardware.envelope import GuardedOutput, OutputState
from hardware.errors import BeamLost, HardwareError, LimitViolation, LinkLost, TimedOut
from hardware.regulation import LOOP, InverseLoop, LoopPlan, LoopStation, record_loop, regulate
from hardware.simulators.bench_server import MACHINES, BenchServer, Stand
from hardware.simulators.bench_server.config import config_from
from hardware.simulators.plants import PlatePlant
from hardware.station import OpenStation, open_station, settings_from
from hardware.station.virtual import station_table
from hardware.storage import Provenance, flags_of, open_journal, recover
from tests.hardware.envelope.device import Device, RawDevice, TrueTime
from tests.hardware.envelope.test_state_machine import ENVELOPES
from tests.hardware.regulation.test_obeys import Notes, WildController, WildSensor

Make = Callable[..., Any]
RATE = 500.0
HYSTERETIC = {
    "effect": "none", "seed": 5, "play_radii": [4.0, 12.0], "play_gains": [0.15, 0.1],
}  # fmt: skip


def swing(size: float = 4e-6, ticks: int = 300) -> Any:
    return 0.5 * size * (1.0 - np.cos(2.0 * np.pi * np.arange(ticks) / ticks))


def linear(integral: float = 0.3 * RATE) -> InverseLoop:
    return InverseLoop(PrandtlIshlinskii((0.0,), (50e-9,)), 0.0, integral, RATE)


def untouched(server: Any) -> bool:
    return not server.devices["card"].front.log


def test_feedback_takes_hysteresis_out(bench: Make, tmp_path: Path) -> None:
    errors = {}
    for name, integral in (("open", 0.0), ("closed", 0.3 * RATE)):
        server, station = bench(plant=HYSTERETIC)
        plan = LoopPlan(swing(), RATE, name=name)
        done = record_loop(station.loop(plan), plan, linear(integral), tmp_path / name)
        r = done.recording
        errors[name] = np.std(np.asarray(r["x"]) - np.asarray(r["x_ref"])) / 4e-6
        assert server.rig.volts == 0.0
        assert r.n == 300
        assert done.timing.missed == 0
        assert Provenance.of(r).output_end == "parked"
        assert any("virtual and waits" in s for s in done.sentences)
    assert errors["open"] > 0.03
    assert errors["closed"] < 0.01


def test_the_reading_is_the_newest_before_the_write(bench: Make, target: Path) -> None:
    server, station = bench()
    plan = LoopPlan(swing(), RATE)
    record_loop(station.loop(plan), plan, linear(), target)
    data = open_journal(target.with_suffix(".journal")).read(LOOP)
    instants = data.channels["instant"]
    true = server.rig.seen(instants).x
    # a sixteen thousandth of a second old at most, and the noise of the sensor
    drift = np.abs(np.gradient(true, instants)).max() / 16e3
    x = data.channels["x"] - data.channels["x"][0]
    assert np.abs(x - (true - true[0])).max() < drift + 30e-9


def test_what_the_envelope_holds_back_is_flagged(bench: Make, target: Path) -> None:
    _, station = bench()
    plan = LoopPlan(swing(9e-6), RATE)
    done = record_loop(station.loop(plan), plan, linear(), target)
    r = done.recording
    cut = np.asarray(flags_of(r, LOOP) & np.uint16(Flag.CLAMPED)) != 0
    np.testing.assert_array_equal(cut, np.asarray(r["V"]) != np.asarray(r["V_asked"]))
    assert cut.sum() == done.timing.cut
    assert np.asarray(r["V"]).max() == 100.0
    # nothing was wound up: it follows again as soon as it can
    back = (np.arange(r.n) > 230) & (np.asarray(r["x_ref"]) > 0.2e-6)
    assert np.abs(np.asarray(r["x"]) - np.asarray(r["x_ref"]))[back].max() < 0.1e-6


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        ("beam_loss_at=3000", BeamLost),
        ("fade_from=2000 fade_samples=500", BeamLost),
        ("cut_after_bytes=9000", LinkLost),
    ],
)
def test_a_lost_sensor_parks_and_keeps(
    bench: Make, target: Path, fault: str, error: type[HardwareError]
) -> None:
    server, station = bench()
    plan = LoopPlan(swing(), RATE, patience=0.5)

    def hurt(step: Any) -> None:
        if step.phase == "play" and step.written < 60:
            assert server.control.answer(f"FAULT interferometer {fault}").startswith("OK")

    with pytest.raises(error) as caught:
        record_loop(station.loop(plan), plan, linear(), target, hurt)
    assert any("take.journal" in n for n in caught.value.__notes__)
    assert server.rig.volts == 0.0
    raw = open_journal(target.with_suffix(".journal"))
    assert raw.notes[-1].content["output_end"] == "parked"
    assert raw.read(LOOP).n > 5
    assert recover(target.with_suffix(".journal"))
    assert server.extremes.highest <= 100.0


def test_what_cannot_be_is_refused_before_anything_moves(bench: Make, target: Path) -> None:
    server, station = bench()
    optics = station.settings.interferometer
    station.settings = replace(station.settings, interferometer=replace(optics, rate=50e3))
    with pytest.raises(UnusableInput, match=r"rate = 50000 Hz.*16000 Hz at most"):
        station.loop(LoopPlan(swing(), RATE))
    station.settings = replace(station.settings, interferometer=replace(optics, rate=400.0))
    plan = LoopPlan(swing(), RATE)
    with pytest.raises(UnusableInput, match=r"500 Hz .* the interferometer allows 400 Hz"):
        record_loop(station.loop(plan), plan, linear(), target)
    with pytest.raises(UnknownName, match="y"):
        station.loop(LoopPlan(swing(), RATE, reading="y"))
    assert untouched(server)
    assert not list(target.parent.iterdir())


class SlowSensor(WildSensor):
    """Takes three milliseconds of the computer for a reading."""

    def poll(self) -> Sequence[Chunk]:
        WallClock().sleep(3e-3)
        return [self.chunk(0.0)]


def test_a_rate_that_the_host_does_not_reach_is_refused_at_rest() -> None:
    device = Device(TrueTime())
    wall = WallClock()
    output = GuardedOutput(RawDevice(device, False), ENVELOPES[0], wall)
    sensor = SlowSensor(np.random.default_rng(1), device.clock, 0.0)
    station = LoopStation(wall, output, sensor, 5e3, "the envelope")
    controller = WildController(sensor.rng, ENVELOPES[0], 0.0)
    with pytest.raises(UnusableInput, match=r"1 kHz was asked for, but a cycle takes"):
        regulate(station, LoopPlan(np.zeros(9), 1e3), controller, Notes())
    assert {after for *_, after, _ in device.steps} == {0.0}


class StallingSensor(WildSensor):
    """The program stands still once, for thirty milliseconds."""

    def poll(self) -> Sequence[Chunk]:
        if self.count == 60:
            self.clock.sleep(0.03)
        return [self.chunk(0.0)]


def test_a_stall_leaves_ticks_out_and_says_so() -> None:
    clock = TrueTime()
    output = GuardedOutput(RawDevice(Device(clock), False), ENVELOPES[0], clock)
    sensor = StallingSensor(np.random.default_rng(1), clock, 0.0)
    station = LoopStation(clock, output, sensor, 5e3, "the envelope")
    notes = Notes()
    timing = regulate(station, LoopPlan(np.zeros(100), 1e3), linear(), notes)
    assert timing.missed == pytest.approx(29, abs=1)
    assert timing.ticks == 100 - timing.missed
    numbers = np.concatenate([c.first + np.arange(c.n) for c in notes.chunks if c.stream == LOOP])
    assert np.diff(numbers).max() == timing.missed + 1
    assert any(f"{timing.missed} missed" in s for s in timing.sentences)


def test_a_silent_sensor_ends_the_loop() -> None:
    class Silent(WildSensor):
        def poll(self) -> Sequence[Chunk]:
            return [self.chunk(0.0)] if self.count < 80 else []

    clock = TrueTime()
    device = Device(clock)
    output = GuardedOutput(RawDevice(device, False), ENVELOPES[0], clock)
    sensor = Silent(np.random.default_rng(1), clock, 0.0)
    station = LoopStation(clock, output, sensor, 5e3, "the envelope")
    with pytest.raises(TimedOut, match=r"no new reading for .* allowed are 50 ms"):
        regulate(station, LoopPlan(np.zeros(400), 1e3, patience=0.05), linear(), Notes())


# ---- the ultrasonic machine


@pytest.fixture
def machine(library: str) -> Iterator[Callable[..., tuple[BenchServer, OpenStation]]]:
    """Return what makes a bench of a plant and a driver, and its station."""
    opened: list[Any] = []

    def make(stand: Stand | None = None, **table: Any) -> tuple[BenchServer, OpenStation]:
        extra = table.pop("station", {})
        config = config_from(table)
        server = BenchServer(config, stand=stand, plants=MACHINES)
        addresses = server.start()
        opened.append(server.stop)
        told = station_table(addresses, config, library)
        station = open_station(settings_from({**told, **extra}))
        opened.append(station.close)
        return server, station

    yield make
    for close in reversed(opened):
        close()


STAGE = {"plant": {"name": "m661", "seed": 1}, "driver": "ultrasonic"}


def stage_loop(tolerance: float = 0.0) -> StageLoop:
    lead = designed(20.0).time_constant
    controller: PositionController = designed(20.0, derivative=lead).controller
    return StageLoop(controller, Sampling(RATE, tolerance=tolerance))


def test_the_stage_goes_where_it_is_sent(machine: Make, target: Path) -> None:
    server, station = machine(**STAGE)
    plan = LoopPlan(np.full(250, 5e-4), RATE)
    done = record_loop(station.loop(plan), plan, stage_loop(), target)
    x = np.asarray(done.recording["x"])
    assert np.abs(x[-50:] - 5e-4).max() < 2e-5
    assert "C-184.161" in Provenance.of(done.recording).streams[0].device.model
    assert server.rig.volts == 0.0
    # open loop a constant voltage drives it on until an end of travel
    assert np.abs(np.asarray(done.recording["V"])).max() <= 10.0


def test_an_end_of_travel_parks_the_stage(machine: Make, target: Path) -> None:
    ends = {"ultrasonic": {"lower_end": 0, "upper_end": 1}}
    server, station = machine(station=ends, **STAGE)
    plan = LoopPlan(np.full(200, 4e-3), RATE)

    def arrive(step: Any) -> None:
        if step.phase == "play" and step.written > 30:
            server.devices["card"].front.registers.lines_in = 0b10

    with pytest.raises(LimitViolation, match="upper end of travel"):
        record_loop(station.loop(plan), plan, stage_loop(), target, arrive)
    assert server.rig.volts == 0.0
    assert station.output.state is OutputState.PARKED


def test_a_wave_into_an_end_of_travel_is_ended(machine: Make, target: Path) -> None:
    from hardware.recorder import TakePlan, record

    ends = {"ultrasonic": {"lower_end": 0, "upper_end": 1}}
    server, station = machine(station=ends, **STAGE)
    plan = TakePlan(np.linspace(0.0, 8.0, 1000), 1e3, "far", "none")

    def arrive(step: Any) -> None:
        if step.phase == "play" and step.written > 500:
            server.devices["card"].front.registers.lines_in = 0b10

    with pytest.raises(LimitViolation, match="into an end of travel"):
        record(station.station(plan), plan, target, watch=arrive)
    assert server.rig.volts == 0.0
    assert station.output.state is OutputState.PARKED


def test_an_ultrasonic_driver_and_an_amplifier_exclude_each_other() -> None:
    table = {
        "envelope": {"v_min": -10.0, "v_max": 10.0, "slew": 1e5},
        "output": {"kind": "mf634"}, "ultrasonic": {},
    }  # fmt: skip
    assert settings_from(table).ultrasonic is not None
    with pytest.raises(UnusableInput, match=r"takes the place of \[amplifier\]"):
        settings_from({**table, "amplifier": {"gain": 20.0}})
    with pytest.raises(UnusableInput, match="readout"):
        settings_from(
            {"envelope": table["envelope"], "output": {"kind": "gcs", "address": "a:1"},
             "readout": {"channel": "lag", "scale": 5.0}}
        )  # fmt: skip
    with pytest.raises(UnusableInput, match="largest amplitude"):
        settings_from({**table, "ultrasonic": {"largest": 12.0}})


def test_the_lock_follows_a_resonance_that_warms(machine: Make, target: Path) -> None:
    plant = PlatePlant(warming=0.25, aside=400.0)
    _, station = machine(
        Stand(plant), plant={"name": "plate"}, driver="oscillator", fronts=["card"], readout=5.0
    )
    rate, tuning = 400.0, 1000.0
    plan = LoopPlan(np.zeros(400), rate, reading="lag")
    loop = InverseLoop(
        PrandtlIshlinskii((0.0,), (tuning / 1075.0,)), 0.0, 2.0 * np.pi * 10.0, rate,
        feedforward=False,
    )  # fmt: skip
    done = record_loop(station.loop(plan), plan, loop, target)
    volts, lag = (np.asarray(done.recording[n]) for n in ("V", "lag"))
    # 5 W warm by 30 K, -150 ppm/K of 215 kHz: by hand -967.5 Hz from the cold 400 Hz
    final = 400.0 - 967.5 * (1.0 - np.exp(-1.0 / 0.25))
    assert tuning * volts[-1] == pytest.approx(final, abs=30.0)
    assert np.abs(lag[-100:]).max() < 0.02
    # the same drive held at its start would be off by most of the half width
    assert abs(final - tuning * volts[5]) > 0.3 * 1075.0


GAUGE = {
    "plant": {"name": "m661-gauge", "seed": 2}, "driver": "ultrasonic", "fronts": ["card", "gauge"],
}  # fmt: skip


def test_the_gauge_is_read_at_its_own_rate(machine: Make, target: Path) -> None:
    from hardware.regulation import OpenLoop

    server, station = machine(**GAUGE)
    plan = LoopPlan(np.repeat([0.0, 6.0], 60), 100.0, reading="F", voltage=True)
    done = record_loop(station.loop(plan), plan, OpenLoop(), target)
    r = done.recording
    assert set(r.channels) == {"V", "V_asked", "F", "V_ref"}
    assert (r.units["F"], r.units["V_ref"]) == ("N", "V")
    force = np.asarray(r["F"])
    assert abs(np.median(force[20:60])) < 0.01
    assert np.median(force[90:]) == pytest.approx(1.0, abs=0.15)
    fast = LoopPlan(np.zeros(9), 200.0, reading="F", voltage=True, name="fast")
    with pytest.raises(UnusableInput, match="the gauge allows 100 Hz"):
        record_loop(station.loop(fast), fast, OpenLoop(), target.with_name("fast"))
    assert server.rig.volts == 0.0
