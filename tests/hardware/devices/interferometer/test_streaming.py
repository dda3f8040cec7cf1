"""Streams on the device's clock and on foreign edges, and what can go wrong on the way."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Acquisition, Chunk, Flag, WallClock
from hardware.devices.interferometer import Block, Interferometer, Streaming, Triggered
from hardware.errors import BeamLost, LinkLost, Overrun, TimedOut
from hardware.simulators.rig import DeviceClock, Rig
from hardware.simulators.siosifm import InterferometerFront, Quadrature
from tests.benchmarks.interferometer import stream as count_stream
from tests.hardware.devices.interferometer.bench import (
    GAIN,
    Bench,
    Follower,
    flags,
    joined,
    make_bench,
    stub,
)
from tests.hardware.waits import waits


def test_all_three_are_acquisitions(bench: Bench) -> None:
    for made in (
        Streaming(bench.device),
        Triggered(bench.device, 1000.0),
        Block(bench.device, 10, 1000.0),
    ):
        assert isinstance(made, Acquisition)
        assert made.identity.serial == "B001234"
        assert not made.done


def test_values_are_those_of_the_mirror(bench: Bench) -> None:
    stream = Streaming(bench.device, 2000.0, samples=200)
    stream.kickoff()
    chunks = bench.run(stream, 0.05)
    bench.rig.drive(10.0)
    chunks += bench.run(stream, 0.06)
    assert stream.done
    assert stream.poll() == []
    chunks += stream.finish()
    x = joined(chunks, "x")
    assert x.size == 200
    assert [c.first for c in chunks[:2]] == [0, chunks[0].n]
    assert np.all(np.abs(x[:100]) < 1e-10)
    assert np.all(np.abs(x[103:] - 10.0 * GAIN) < 1e-10)
    assert not flags(chunks).any()
    assert chunks[0].units == {"x": "m", "sample": "1"}


def test_rates_are_those_the_device_can_make(bench: Bench) -> None:
    stream = Streaming(bench.device, 15_990.0)
    stream.kickoff()
    assert stream.rate == pytest.approx(50e6 / 3127)
    stream.abort()
    with pytest.raises(UnusableInput, match=r"-18.*rate"):
        Streaming(bench.device, 17_000.0).kickoff()
    assert "START" not in bench.front.requests[-3:]
    Streaming(bench.device, 4000.0, average=4).kickoff()
    with pytest.raises(UnusableInput):
        Streaming(bench.device, 1000.0, extras=("tilt",))


def test_averaging_in_the_device_lowers_the_noise() -> None:
    spread = []
    for average in (1, 16):
        with make_bench(noise=2e-9, resolution=1e-11) as bench:
            stream = Streaming(bench.device, 1000.0, average=average)
            stream.kickoff()
            spread.append(float(np.std(joined(bench.run(stream, 0.5), "x"))))
            stream.finish()
    assert spread[0] == pytest.approx(2e-9, rel=0.15)
    assert spread[1] == pytest.approx(0.5e-9, rel=0.15)


@pytest.mark.parametrize("native", [True, False])
def test_raw_quadrature_and_device_time(native: bool) -> None:
    shape = Quadrature(offset_cosine=0.03, offset_sine=-0.04, ratio=1.07, phase=np.radians(4.0))
    with make_bench(quadrature=shape) as bench:
        names = ("sin", "cos", "clock")
        stream = Streaming(bench.device, 10_000.0, extras=names, native=native)
        stream.kickoff()
        for k in range(20):
            bench.rig.drive(0.5 * k)
            bench.rig.wait(0.001)
        chunks = stream.finish()
        u1, u2, t = (joined(chunks, k) for k in ("cos", "sin", "clock"))
        assert np.ptp(u1) == pytest.approx(2 * 8000.0, rel=0.02)
        assert np.ptp(u2) == pytest.approx(2 * 8000.0 / 1.07, rel=0.02)
        assert np.diff(t) == pytest.approx(1e-4)
        # the counter reads the distorted figure: nanometres of periodic error
        error = joined(chunks, "x")[5:195:10] - 0.5 * GAIN * np.arange(19)
        assert 2e-9 < np.ptp(error) < 15e-9


def test_device_clock_runs_by_its_own_rate() -> None:
    with make_bench(DeviceClock(ppm=200.0)) as bench:
        stream = Streaming(bench.device, 10_000.0)
        stream.kickoff()
        n = sum(c.n for c in bench.run(stream, 3.0, 0.1))
        assert n == int(3.0 * 10_000.0 / 1.0002) + 1
        stream.finish()


def test_start_trigger_comes_after_arming_only(bench: Bench) -> None:
    bench.rig.trigger()
    bench.rig.wait(0.01)
    stream = Streaming(bench.device, 1000.0, start=True)
    stream.kickoff()
    bench.rig.wait(0.02)
    assert stream.poll() == []
    bench.rig.trigger()
    bench.rig.wait(0.02)
    assert sum(c.n for c in stream.poll()) == 21
    stream.finish()


@pytest.mark.parametrize("by", ["clock", "event"])
def test_every_edge_gives_one_sample(by: str) -> None:
    with make_bench(DeviceClock(ppm=500.0)) as bench:
        fast = Triggered(bench.device, 1000.0, samples=50, by=by)
        fast.kickoff()
        chunks: list[Chunk] = []
        for k in range(50):
            bench.rig.drive(float(k))
            bench.rig.wait(0.001)
            bench.rig.trigger()
            chunks += fast.poll()
        assert fast.done
        assert fast.external_clock
        x = joined(chunks, "x")
        assert x == pytest.approx(GAIN * np.arange(50), abs=2e-10)
        fast.finish()


def test_clock_edges_count_from_the_start_edge() -> None:
    starts: list[float] = []
    with make_bench(starts=lambda first: starts[first:]) as bench:
        fast = Triggered(bench.device, 1000.0, start=True)
        fast.kickoff()
        for k in range(10):
            if k == 4:
                starts.append(bench.rig.now)
            bench.rig.trigger()
            bench.rig.wait(0.001)
        assert sum(c.n for c in fast.poll()) == 6
        fast.finish()


def test_beam_loss_flags_every_later_sample_and_raises(bench: Bench) -> None:
    bench.faults.beam_loss_at, bench.faults.fringes = 130, -2
    stream = Streaming(bench.device, 10_000.0)
    stream.kickoff()
    before = bench.run(stream, 0.01)
    with pytest.raises(BeamLost, match="sample 130") as caught:
        bench.run(stream, 0.01)
    chunks = [*before, *caught.value.partial]
    marks, x = flags(chunks), joined(chunks, "x")
    assert not marks[:130].any()
    assert np.all(marks[130:] & Flag.BEAM_LOST)
    assert np.all(marks[130:] & Flag.MISCOUNT)
    assert x[130:] == pytest.approx(-2 * 316.4e-9, abs=0.5e-9)
    assert np.abs(x[:130]).max() < 1e-10
    stream.abort()
    with pytest.raises(BeamLost, match="no zero"):
        Streaming(bench.device).kickoff()


def test_status_of_the_device_instead_of_the_value_is_on_the_safe_side(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("BONDSIGHT_BENCH_SIOS_STATUS", "device")
    with make_bench() as bench:
        bench.faults.beam_loss_at = 130
        stream = Streaming(bench.device, 10_000.0)
        stream.kickoff()
        before = bench.run(stream, 0.01)
        assert not flags(before).any()
        with pytest.raises(BeamLost) as caught:
            bench.run(stream, 0.01)
        assert np.all(flags(caught.value.partial) & Flag.BEAM_LOST)


def test_beam_loss_may_be_only_flagged(bench: Bench) -> None:
    bench.faults.beam_loss_at, bench.faults.beam_bits = 50, 1
    stream = Streaming(bench.device, 10_000.0, stop_on_beam_loss=False)
    stream.kickoff()
    chunks = bench.run(stream, 0.02)
    assert np.flatnonzero(flags(chunks))[0] == 50
    assert np.all(flags(chunks)[50:] == Flag.BEAM_LOST | Flag.MISCOUNT)
    stream.finish()
    assert not bench.device.zeroed


def test_fading_warns_before_the_beam_is_lost(bench: Bench) -> None:
    bench.faults.fade_from, bench.faults.fade_samples = 100, 1000
    stream = Streaming(bench.device, 10_000.0)
    stream.kickoff()
    with pytest.raises(BeamLost) as caught:
        bench.run(stream, 0.2, 0.2)
    marks = flags(caught.value.partial)
    warned = int(np.flatnonzero(marks & Flag.LEVEL_LOW)[0])
    lost = int(np.flatnonzero(marks & Flag.BEAM_LOST)[0])
    assert warned == pytest.approx(600, abs=5)
    assert lost - warned > 300


def test_without_amplitudes_the_signal_monitor_warns(bench: Bench) -> None:
    bench.device.amplitude = 0.0  # as of a device whose values have none
    bench.faults.fade_from, bench.faults.fade_samples = 0, 20_000
    stream = Streaming(bench.device, 10_000.0)
    stream.kickoff()
    assert not flags(bench.run(stream, 0.35, 0.35)).any()
    assert np.all(flags(bench.run(stream, 1.15, 1.15)) == Flag.LEVEL_LOW)  # a quarter is left
    stream.abort()


def test_gap_of_the_device_is_found_by_the_counter(bench: Bench) -> None:
    bench.faults.overrun_at, bench.faults.overrun_samples = 120, 7
    stream = Streaming(bench.device, 10_000.0)
    stream.kickoff()
    with pytest.raises(Overrun, match=r"7 samples lost, the first is 120") as caught:
        bench.run(stream, 0.03, 0.03)
    chunks = caught.value.partial
    assert [(c.first, c.n) for c in chunks] == [(0, 120), (127, 301 - 127)]
    marks = flags(chunks)
    assert marks[120] == Flag.LOST_BEFORE
    assert np.count_nonzero(marks) == 1
    # the stream goes on
    bench.rig.wait(0.01)
    assert stream.poll()[0].first == 301
    stream.finish()


@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_lost_silently(bench: Bench, seed: int) -> None:
    rng = np.random.default_rng(seed)
    bench.faults.overrun_at = int(rng.integers(1, 2000))
    bench.faults.overrun_samples = int(rng.integers(1, 300))
    stream = Streaming(bench.device, 10_000.0)
    stream.kickoff()
    chunks: list[Chunk] = []
    told = 0
    for _ in range(20):
        bench.rig.wait(float(rng.exponential(0.02)))
        try:
            chunks += stream.poll()
        except Overrun as fault:
            chunks += fault.partial
            told += 1
    due = int(np.floor(bench.rig.now * 10_000.0 + 1e-6))
    numbers = np.concatenate([c.first + np.arange(c.n) for c in chunks])
    counter = joined(chunks, "sample")
    assert np.array_equal(numbers, counter - counter[0])
    missing = np.setdiff1d(np.arange(numbers[-1] + 1), numbers)
    lost = bench.faults.overrun_at + np.arange(bench.faults.overrun_samples)
    assert np.array_equal(missing, lost[lost < numbers[-1]])
    assert told == min(missing.size, 1)
    assert np.array_equal(numbers[flags(chunks) > 0] - 1, missing[-1:])
    assert abs(due - numbers[-1]) <= bench.faults.overrun_samples + 60
    stream.abort()


def test_polling_too_seldom_is_an_overrun_of_the_library(bench: Bench) -> None:
    stream = Streaming(bench.device, 16_000.0)
    stream.kickoff()
    bench.rig.wait(4.5)  # 72,001 samples are due, 65,536 fit
    first = stream.poll()
    assert sum(c.n for c in first) == 65_536
    bench.rig.wait(0.01)
    with pytest.raises(Overrun, match=r"first is 65536") as caught:
        stream.poll()
    assert caught.value.partial[0].first == 72_001
    stream.finish()


def test_missing_start_trigger_times_out(bench: Bench) -> None:
    bench.faults.no_trigger = True
    stream = Streaming(bench.device, 1000.0, start=True, patience=0.5)
    stream.kickoff()
    bench.rig.trigger()
    with pytest.raises(TimedOut, match="no start trigger"):
        bench.run(stream, 1.0)
    assert bench.rig.now < 0.6
    assert bench.front.requests[-2:] == ("STOP", "CLEAR")
    stream.abort()


def test_clock_that_stops_times_out_with_what_came(bench: Bench) -> None:
    fast = Triggered(bench.device, 1000.0, patience=0.2)
    fast.kickoff()
    for _ in range(5):
        bench.rig.trigger()
        bench.rig.wait(0.001)
    assert sum(c.n for c in fast.poll()) == 5
    with pytest.raises(TimedOut, match=r"no clock edge .* after 5 samples"):
        bench.run(fast, 1.0)
    fast.abort()


@pytest.mark.parametrize("arrive", [0, 40 * 60 + 17])
def test_cable_pulled_mid_transfer_keeps_what_arrived(bench: Bench, arrive: int) -> None:
    stream = Streaming(bench.device, 10_000.0)
    stream.kickoff()
    bench.rig.wait(0.05)
    bench.faults.cut_after_bytes = 8 + arrive
    with waits() as waited:
        with pytest.raises(LinkLost) as caught:
            stream.poll()
        stream.abort()
        bench.device.close()
    assert sum(c.n for c in caught.value.partial) == arrive // 40
    assert waited.seconds < 1.0
    bench.device.reopen()
    with pytest.raises(BeamLost, match="no zero"):
        stream.kickoff()


def test_silent_device_is_a_lost_link(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BONDSIGHT_BENCH_SIOS_TIMEOUT", "0.05")
    with make_bench() as bench:
        stream = Streaming(bench.device)
        stream.kickoff()
        bench.faults.silent = True
        with pytest.raises(LinkLost):
            stream.poll()
        stream.abort()


def test_unstable_laser_flags_from_there_on(bench: Bench) -> None:
    bench.faults.laser_unstable_at = 33
    stream = Streaming(bench.device, 10_000.0)
    stream.kickoff()
    marks = flags(bench.run(stream, 0.01))
    assert np.flatnonzero(marks)[0] == 33
    assert np.all(marks[33:] == Flag.LASER_UNSTABLE)
    stream.finish()
    assert bench.device.health().laser_unstable


def test_stale_air_flags_the_samples(bench: Bench) -> None:
    stream = Streaming(bench.device, 1000.0)
    stream.kickoff()
    assert not flags(bench.run(stream, 0.5, 0.1)).any()
    bench.faults.stale_air = True
    assert flags(bench.run(stream, 2.0, 0.1))[-1] == Flag.AIR_STALE
    stream.finish()


def test_ten_seconds_at_16_khz_lose_nothing(bench: Bench) -> None:
    told = count_stream(bench.rig, bench.device, 16_000.0, 10.0)
    assert (told.samples, told.lost) == (160_001, 0)
    assert told.largest_chunk <= 321


@pytest.mark.long
def test_a_minute_at_16_khz_loses_nothing_in_bounded_memory(bench: Bench) -> None:
    count_stream(bench.rig, bench.device, 16_000.0, 5.0)  # everything loaded
    told = count_stream(bench.rig, bench.device, 16_000.0, 60.0)
    assert (told.samples, told.lost) == (960_001, 0)
    assert told.growth < 10.0


@pytest.mark.long
def test_a_minute_of_real_time_at_16_khz_loses_nothing() -> None:
    clock = WallClock()
    rig = Rig(Follower(), keep=10.0)
    front = InterferometerFront(rig)
    begin = clock.now()
    rig.pace(lambda: clock.now() - begin)
    try:
        with Interferometer(f"net:{front.start()}", library=stub(), clock=clock) as device:
            device.zero()
            stream = Streaming(device, 16_000.0, samples=960_000)
            stream.kickoff()
            following = 0
            while not stream.done:
                clock.sleep(0.02)
                for chunk in stream.poll():
                    assert chunk.first == following
                    following += chunk.n
            assert following == 960_000
            stream.finish()
    finally:
        front.stop()
