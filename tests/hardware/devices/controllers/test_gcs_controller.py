"""What a GCS controller does when all is well, by our own client and by PIPython."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Acquisition, Flag, RawOutput
from hardware.devices.controllers import GcsController, GcsRecorder, GcsSetup, GcsWave
from hardware.devices.controllers.gcs_recorder import gcs_array
from hardware.envelope import (
    P840_1_UNIPOLAR,
    GuardedOutput,
    GuardedWave,
    OutputState,
    RawWave,
)
from hardware.errors import LimitViolation, Overrun, ProtocolFault, TimedOut
from hardware.simulators.controllers import CommandWatchdog, GcsModel
from hardware.simulators.rig import DeviceClock
from tests.hardware.devices.controllers.bench import WAYS, Bench, bench


@pytest.fixture(params=WAYS)
def there(request: pytest.FixtureRequest) -> Iterator[Bench]:
    with bench(request.param) as b:
        b.controller.power_up()
        yield b


def test_contract(there: Bench) -> None:
    assert isinstance(there.controller, RawOutput)
    assert isinstance(GcsWave(there.controller), RawWave)
    assert isinstance(GcsRecorder(there.controller, 10, 1e4), Acquisition)
    assert not there.controller.has_watchdog


def test_identity_and_limits(there: Bench) -> None:
    identity = there.controller.identity
    assert identity.maker == "(c)Simulated Instruments"
    assert (identity.model, identity.serial) == ("E-700.1CD", "0120034567")
    assert there.controller.limits() == (-20.0, 120.0)
    assert there.controller.travel() == pytest.approx((0.0, 4e-6))
    assert there.controller.stage() == "SIMSTACK"


def test_open_loop(there: Bench) -> None:
    for volts in (10.0, 99.5, 0.0):
        there.controller.write(volts)
        there.rig.wait(0.01)
        assert there.rig.volts == volts
        assert there.controller.read() == pytest.approx(volts, abs=1e-6)
        assert there.controller.position() == pytest.approx(3e-8 * volts, abs=1e-12)


def test_power_up_walks_down_from_what_stands_there() -> None:
    with bench("own") as there:
        there.front.device.axis.command(80.0)
        there.front.device.axis.close_loop(True)
        there.controller.power_up()
        sent = [c for c in there.front.device.commands if c.startswith("SVA ")]
        steps = np.diff([80.0, *(float(c.split()[2]) for c in sent)])
        assert there.rig.volts == 0.0
        assert not there.front.device.axis.servo
        assert np.all(steps <= 0.0)
        assert np.abs(steps).max() <= 1.0 + 1e-9
        assert there.rig.now == pytest.approx(0.8, abs=0.05)


def test_closed_loop(there: Bench) -> None:
    with pytest.raises(ProtocolFault, match="error 5 "):
        there.controller.move(1e-6)
    there.controller.servo(True)
    there.controller.move(1.5e-6)
    there.controller.settle(1.0)
    assert there.controller.position() == pytest.approx(1.5e-6, abs=1e-8)
    with pytest.raises(LimitViolation, match="error 7 "):
        there.controller.move(9e-6)
    with pytest.raises(ProtocolFault, match="error 303"):
        there.controller.write(1.0)
    there.controller.servo(False)
    assert there.rig.volts == pytest.approx(50.0, abs=0.5)


def test_settle_has_an_end() -> None:
    with bench("own", GcsModel(closed_gain=0.0)) as there:
        there.controller.power_up()
        there.controller.servo(True)
        there.controller.move(1e-6)
        with pytest.raises(TimedOut, match="not on target"):
            there.controller.settle(0.1)


def test_stops(there: Bench) -> None:
    there.controller.write(30.0)
    there.controller.halt()
    there.controller.stop()
    assert there.controller.read() == pytest.approx(30.0)


def test_scale_of_the_control_value() -> None:
    with bench("own", setup=GcsSetup(scale=10.0, offset=5.0)) as there:
        there.controller.open()
        there.controller.write(55.0)
        assert there.front.device.commands[-2].startswith("SVA 1 5.0")


def test_wrong_scale_is_found_before_anything_moves() -> None:
    with bench("own", setup=GcsSetup(scale=10.0)) as there:
        there.front.device.axis.command(30.0)
        with pytest.raises(ProtocolFault, match="scale"):
            there.controller.power_up()
        assert there.rig.volts == 30.0


def test_servo_time_of_the_setup() -> None:
    with bench("own", setup=GcsSetup(servo_time=1e-4)) as there:
        there.controller.open()
        assert there.controller.divider(5e3, "play") == 2
        with pytest.raises(UnusableInput, match="10000 Hz by a whole number"):
            there.controller.divider(20e3, "play")
        with pytest.raises(UnusableInput):
            there.controller.divider(-1.0, "play")


def wave(n: int = 2000) -> np.ndarray:
    return 50.0 - 50.0 * np.cos(2.0 * np.pi * np.arange(n) / n)


def test_wave_and_recorder_on_the_device_clock(there: Bench) -> None:
    c = there.controller
    player = GcsWave(c)
    player.load(wave(), 20e3)
    recorder = GcsRecorder(c, 1000, 10e3)
    recorder.kickoff()
    start = there.rig.now
    chunks, written = [], 0
    for report in player.play():
        assert report.samples >= written
        written = report.samples
        chunks += list(recorder.poll())
    chunks += list(recorder.finish())
    assert written == 2000
    assert recorder.done
    assert there.rig.trigger_edges == pytest.approx((start,), abs=1e-9)
    volts = np.concatenate([k.channels["V_mon"] for k in chunks])
    x = np.concatenate([k.channels["x"] for k in chunks])
    np.testing.assert_allclose(volts, wave()[::2], atol=2e-6)
    np.testing.assert_allclose(x[10:], 3e-8 * wave()[::2][10:], atol=1e-8)
    assert [k.first for k in chunks] == list(np.cumsum([0] + [k.n for k in chunks[:-1]]))


def test_reports_cover_every_sample_once(there: Bench) -> None:
    player = GcsWave(there.controller, trigger_line=None)
    player.load(wave(1000), 5e3)
    chunks = [k for report in player.play() for k in report.chunks]
    np.testing.assert_allclose(np.concatenate([k.channels["V"] for k in chunks]), wave(1000))
    instants = np.concatenate([k.channels["instant"] for k in chunks])
    np.testing.assert_allclose(np.diff(instants), 1.0 / 5e3, rtol=1e-6)
    assert all(np.all(k.flags == Flag.UNSYNCHRONISED) for k in chunks)
    assert there.rig.trigger_edges == ()


def test_leaving_a_wave_stops_it_where_it_is(there: Bench) -> None:
    player = GcsWave(there.controller)
    player.load(wave(), 20e3)
    playing = player.play()
    next(playing)
    playing.close()  # type: ignore[attr-defined]
    stands = there.rig.volts
    there.rig.wait(0.5)
    assert there.rig.volts == stands
    assert not there.controller.wave_runs()


def position(player: GcsWave) -> int | None:
    return player.position


def test_only_what_the_device_tells_of_its_position_is_told(there: Bench) -> None:
    player = GcsWave(there.controller)
    assert position(player) == 0
    player.load(wave(), 20e3)
    playing = player.play()
    assert position(player) == 0
    next(playing)
    with pytest.raises(ProtocolFault, match="playing"):
        player.load(0.5 * wave(), 20e3)
    playing.close()  # type: ignore[attr-defined]
    assert position(player) is None
    chunks = [k for report in player.play() for k in report.chunks]
    assert np.array_equal(np.concatenate([k.channels["V"] for k in chunks]), wave())
    assert position(player) == 2000
    player.play()
    player.abort()
    assert position(player) == 0
    player.load(1.5 * wave(), 20e3)
    with pytest.raises(LimitViolation, match="302"):
        list(player.play())
    assert position(player) == 0


def test_wave_that_stops_at_the_device(there: Bench) -> None:
    player = GcsWave(there.controller)
    player.load(wave(), 20e3)
    playing = player.play()
    next(playing)
    there.front.device.generator.stop()
    with pytest.raises(ProtocolFault, match="stopped after about") as fault:
        for _ in playing:
            pass
    assert fault.value.partial.samples < 2000


def test_a_wave_that_stops_just_before_its_end_is_not_complete() -> None:
    with bench("own") as there:
        output = GuardedOutput(there.controller, P840_1_UNIPOLAR, there.clock)
        output.power_up()
        player = GcsWave(there.controller)
        guarded = GuardedWave(output, player)
        volts = np.concatenate([np.linspace(0.0, 80.0, 9000), np.linspace(80.0, 0.0, 1000)])
        guarded.prepare(volts, 2e3)
        stop = there.front.device.generator.stop
        reports = guarded.play()
        first = next(reports)
        # 25 ms of 5 s before the end, where the output still has some 4 V
        there.rig.at(there.rig.now + 4.955, stop)
        with pytest.raises(ProtocolFault, match=r"stopped at 3\.\d+ V where") as fault:
            list(reports)
        assert first.samples < fault.value.partial.samples <= 10_000
        assert position(player) is None
        assert there.rig.volts == 0.0
        assert output.state is OutputState.PARKED
        assert there.rig.extremes.largest_step < 2.0


def test_wave_beyond_the_device_is_refused(there: Bench) -> None:
    player = GcsWave(there.controller)
    with pytest.raises(UnusableInput, match="nearest"):
        player.load(wave(), 19e3)
    with pytest.raises(LimitViolation):
        player.load(np.array([0.0, np.nan]), 20e3)
    player.load(1.5 * wave(), 20e3)
    with pytest.raises(LimitViolation, match="302"):
        list(player.play())
    assert there.rig.extremes.highest <= 0.0


def test_too_long_for_the_tables() -> None:
    with bench("own", GcsModel(points=400, tables=4)) as there:
        there.controller.power_up()
        with pytest.raises(Overrun, match="400"):
            GcsWave(there.controller).load(wave(401), 20e3)
        recorder = GcsRecorder(there.controller, 101, 20e3)
        before = len(there.front.device.commands)
        with pytest.raises(Overrun, match="100"):
            recorder.kickoff()
        assert not any("DRC " in c for c in there.front.device.commands[before:])


@pytest.mark.parametrize("tables", [0, 1])
def test_controller_without_the_recorder_tables(tables: int) -> None:
    with bench("own", GcsModel(tables=tables)) as there:
        there.controller.power_up()
        before = len(there.front.device.commands)
        with pytest.raises(ProtocolFault, match=f"has {tables} recorder tables"):
            GcsRecorder(there.controller, 100, 20e3).kickoff()
        assert not any("DRC " in c for c in there.front.device.commands[before:])


def test_recorder_at_once_with_a_clock_of_its_own() -> None:
    clock = DeviceClock(ppm=200.0, offset=3e-4)
    with bench("own", GcsModel(noise=1e-9, seed=3), clock) as there:
        there.controller.power_up()
        recorder = GcsRecorder(there.controller, 5000, 10e3, trigger="now")
        there.controller.write(10.0)
        recorder.kickoff()
        started = there.rig.now
        there.rig.wait(0.1)
        there.controller.write(20.0)
        stepped = there.rig.now
        there.rig.wait(1.0)
        chunks = recorder.finish()
        volts = np.concatenate([k.channels["V_mon"] for k in chunks])
        x = np.concatenate([k.channels["x"] for k in chunks])
        edge = int(np.argmax(volts > 15.0))
        late = stepped - started - 3e-4
        assert edge == int(np.ceil(late / (1.0 + 200e-6) * 10e3))
        assert np.std(x[edge + 50 :]) == pytest.approx(1e-9, rel=0.1)
        again = GcsRecorder(there.controller, 5000, 10e3, trigger="now")
        assert again.poll() != ()  # what the device still holds
        again.kickoff()
        assert len(again.poll()) <= 1


def test_bench_whose_time_passes_by_itself() -> None:
    with bench("own") as there:
        began = time.perf_counter()
        there.rig.pace(lambda: time.perf_counter() - began)
        controller = GcsController(there.talk)
        controller.power_up()
        player = GcsWave(controller)
        player.load(wave(400), 10e3)
        recorder = GcsRecorder(controller, 400, 10e3)
        recorder.kickoff()
        assert [w.samples for w in player.play()][-1] == 400
        (chunk,) = recorder.finish()
        np.testing.assert_allclose(chunk.channels["V_mon"], wave(400), atol=2e-6)
        assert there.rig.extremes.largest_step < 1.0


def test_watchdog_option_brings_the_output_down() -> None:
    model = GcsModel(watchdog=CommandWatchdog(0.2, rate=1000.0))
    with bench("own", model, setup=GcsSetup(watchdog=True)) as there:
        assert there.controller.has_watchdog
        there.controller.power_up()
        for _ in range(5):
            there.rig.wait(0.15)
            there.controller.write(80.0)
        assert there.rig.volts == 80.0
        there.controller.close()
        there.rig.wait(0.19)
        assert there.rig.volts == 80.0
        there.rig.wait(0.3)
        assert there.rig.volts == 0.0
        assert there.rig.extremes.largest_step == 80.0, "only the client has made that step"


def test_without_a_watchdog_the_output_stays() -> None:
    with bench("own") as there:
        there.controller.power_up()
        there.controller.write(80.0)
        there.controller.close()
        there.rig.wait(100.0)
        assert there.rig.volts == 80.0


@pytest.mark.parametrize(
    "text",
    ["", "# DIM = 2\n# NDATA = 1\n1 2", "# DIM = 2\n# NDATA = 2\n# END_HEADER\n1 2\n3"],
)
def test_broken_array(text: str) -> None:
    with pytest.raises(ProtocolFault):
        gcs_array(text, "here")
