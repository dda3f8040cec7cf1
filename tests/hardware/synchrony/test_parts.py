"""Gaps, drift, jitter, intervals that hold, one time base, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnknownName, UnusableInput
from hardware.contracts import Chunk, Flag
from hardware.simulators.rig import DeviceClock
from hardware.synchrony import (
    Budget,
    ClockWiring,
    HeldColumns,
    Stream,
    TimeMap,
    align,
    between,
    merged,
)
from tests.hardware.synchrony.bench import LAG, RATE, many, record, sine

KNOWN = ClockWiring(lag=LAG)


def test_map_and_its_inverse() -> None:
    t = np.linspace(0.0, 11.0, 300)
    for m in (TimeMap(3e-4, -60e-6, 9e-6), TimeMap(-2e-3, 90e-6)):
        assert np.abs(m.to_sensor(m.to_drive(t)) - t).max() < 1e-13
    with pytest.raises(UnusableInput, match="backwards"):
        TimeMap(skew=-1.5)


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_held_drive_is_the_exact_answer_of_a_lag(hold: str) -> None:
    rng = np.random.default_rng(0)
    b, step, lag = rng.standard_normal(20), 0.1, 0.07
    fine = 4000
    t = np.arange(20 * fine) * step / fine
    k = np.arange(t.size) // fine
    p = t - k * step
    u = b[k]
    if hold == "linear":
        u = u + np.append(np.diff(b), 0.0)[k] * p / step
    e = np.exp(-step / fine / lag)
    v = np.empty(t.size)
    now = b[0]
    for n in range(0, t.size):  # explicit and slow, to compare with
        v[n] = now
        now = u[n] + (now - u[n]) * e
    got, slope = HeldColumns(b[:, None], step, hold, lag).at(t)  # type: ignore[arg-type]
    assert np.abs(got[:, 0] - v).max() < 2e-3
    inner = (p > 1e-6) & (p < step - 2 * step / fine)
    numeric = np.gradient(got[:, 0], t)
    assert np.abs(slope[:, 0] - numeric)[inner].max() < 0.05 * np.abs(slope).max()


@pytest.mark.parametrize(
    "gaps", [[(900, 1)], [(1700, 37)], [(1100, 3), (2900, 211)]], ids=["one", "37", "two gaps"]
)
def test_lost_samples_are_found(gaps: list[tuple[int, int]]) -> None:
    drive, sensor = record(sine(20.0), DeviceClock(ppm=37.0, offset=123e-6), n=6000, length=False)
    kept = np.ones(6000, bool)
    for first, missing in gaps:
        kept[first : first + missing] = False
    copy = sensor.channels["V_copy"][kept]
    found = align(drive, Stream.of(RATE, V_copy=copy), KNOWN)
    assert [(g.first, g.missing) for g in found.gaps] == [
        (a - lost_before(gaps, i), m) for i, (a, m) in enumerate(gaps)
    ]
    assert abs(found.map.delay - 123e-6) < 1.5e-6
    together = merged(drive, Stream.of(RATE, V_copy=copy), found)
    assert int(np.isnan(together.channels["V_copy"]).sum()) >= sum(m for _, m in gaps)
    assert np.count_nonzero(together.flags & int(Flag.LOST_BEFORE)) >= sum(m for _, m in gaps)


def lost_before(gaps: list[tuple[int, int]], index: int) -> int:
    return sum(m for _, m in gaps[:index])


def test_a_drifting_ratio() -> None:
    clock = DeviceClock(ppm=-20.0, offset=200e-6, drift_ppm=300.0)
    drive, sensor = record(sine(20.0), clock, length=False)
    found = align(drive, sensor, ClockWiring(lag=LAG, drifting=True))
    low, high = found.drift_interval
    assert low < 5e-6 < high
    assert abs(found.map.skew + 20e-6) < 0.2e-6
    # a constant ratio does not explain the record, and that is said
    stiff = align(drive, sensor, KNOWN)
    assert any("drift" in n for n in stiff.notes)
    assert stiff.worst > 10.0 * found.worst


def test_jitter_is_told_from_noise() -> None:
    drive, sensor = record(
        sine(20.0), DeviceClock(ppm=5.0, offset=1e-4, jitter=3e-6, seed=1), n=8192, length=False
    )
    found = align(drive, sensor, KNOWN)
    assert abs(found.jitter - 3e-6) < 4.0 * found.jitter_error
    assert found.jitter_error < 0.3e-6


def test_a_wrong_start_of_many_samples_is_found() -> None:
    drive, sensor = record(many, DeviceClock(ppm=-400.0, offset=0.137), n=8192, length=False)
    found = align(drive, sensor, ClockWiring(lag=LAG, most_delay=0.3))
    assert abs(found.map.delay - 0.137) < 3e-6
    assert not found.alternatives


def test_a_period_later_the_record_is_the_same() -> None:
    begun = ClockWiring(lag=LAG, most_delay=0.02)
    drive, sensor = record(sine(125.0), DeviceClock(), n=8192, length=False)
    onset = align(drive, sensor, begun)
    assert abs(onset.map.delay) < 1e-6
    assert not onset.alternatives  # rest to motion is in the record
    drive, sensor = record(sine(125.0), DeviceClock(offset=0.05), n=8192, length=False)
    running = align(drive, sensor, ClockWiring(lag=LAG, delay=0.05, most_delay=0.02))
    assert abs(running.map.delay - 0.05) < 1e-6
    assert [round(1e3 * d) for d in running.alternatives] == [34, 42, 58, 66]
    assert running.flag is Flag.UNSYNCHRONISED  # said and flagged, not hidden
    assert "looks the same" in str(running)


@pytest.mark.long
def test_many_tones_tell_the_delay_if_the_actuator_has_no_lag() -> None:
    clock = DeviceClock(ppm=37.0, offset=500e-6)
    drive, sensor = record(many, clock, n=12288)
    alone = Stream.of(RATE, x=sensor.channels["x"])
    unknown = align(drive, alone, KNOWN)
    assert not unknown.delay_known
    assert any("less the actuator's own lag" in n for n in unknown.notes)
    found = align(drive, alone, ClockWiring(lag=LAG, plant_lag_error=2e-6))
    low, high = found.delay_interval
    if found.delay_known:
        assert low < 500e-6 < high
        assert high - low < 200e-6
    slow, fast = found.skew_interval
    assert slow < 37e-6 < fast


def covered(draws: int, n: int, f: float) -> tuple[float, float]:
    """Share of 95 % intervals of delay and skew that hold the truth."""
    rng = np.random.default_rng(7)
    hits = np.zeros((draws, 2), bool)
    for k in range(draws):
        ppm, delay, lag = rng.uniform(-100, 100), rng.uniform(-1e-3, 2e-3), rng.uniform(6e-5, 4e-4)
        drive, sensor = record(
            sine(f), DeviceClock(ppm=ppm, offset=delay), n=n, lag=lag, seed=k, length=False
        )
        found = align(drive, sensor, ClockWiring(lag=lag))
        (a, b), (c, d) = found.delay_interval, found.skew_interval
        hits[k] = a <= delay <= b, c <= 1e-6 * ppm <= d
    return float(hits[:, 0].mean()), float(hits[:, 1].mean())


def test_intervals_hold() -> None:
    for share in covered(25, 4000, 30.0):
        assert share >= 0.8  # 0.95 of 25 less three standard errors


@pytest.mark.long
@pytest.mark.parametrize("f", [5.0, 100.0])
def test_intervals_hold_over_hundreds(f: float) -> None:
    for share in covered(300, 4000, f):
        assert 0.90 <= share <= 0.995


def test_flags_and_gaps_are_carried_over() -> None:
    x = np.sin(np.arange(400) / 20.0)
    flags = np.zeros(400, np.uint16)
    flags[200] = Flag.LEVEL_LOW
    at = np.asarray(np.arange(50, 350) + 0.37, float)
    got = between(x, flags, at)
    assert np.abs(got.values - np.sin(at / 20.0)).max() < 3e-5
    touched = np.flatnonzero(got.flags & int(Flag.LEVEL_LOW)) + 50
    assert touched.min() == 200 - 16
    assert touched.max() == 200 + 15
    x[100] = np.nan
    got = between(x, flags, at)
    assert np.isnan(got.values[[49, 50]]).all()
    assert np.isfinite(got.values[[48, 51]]).all()


def test_merging_on_the_drive_and_on_the_sensor() -> None:
    drive, sensor = record(sine(20.0), DeviceClock(ppm=37.0, offset=123e-6), n=8192)
    found = align(drive, sensor, KNOWN)
    own = merged(drive, sensor, found)
    assert own.errors["x"] == 0.0
    assert np.allclose(np.diff(own.time), (1.0 + found.map.skew) / RATE, rtol=0, atol=1e-12)
    assert np.array_equal(own.channels["x"], sensor.channels["x"][-own.time.size :])
    grid = merged(drive, sensor, found, base="drive")
    assert np.allclose(np.diff(grid.time), 1.0 / RATE)
    assert grid.errors["V_copy"] < 1.0
    assert np.nanstd(grid.channels["V_copy"] - grid.channels["V"]) < 1.0
    with pytest.raises(UnusableInput, match="no base"):
        merged(drive, sensor, found, base="other")  # type: ignore[arg-type]


def test_a_stream_from_chunks_marks_what_is_missing() -> None:
    one = Chunk("interferometer", 0, {"x": np.arange(5.0)}, {"x": "m"})
    two = Chunk("interferometer", 9, {"x": np.arange(4.0)}, {"x": "m"})
    stream = Stream.from_chunks([one, two], 100.0)
    assert stream.n == 9
    assert stream.time[5] == pytest.approx(0.09)
    assert stream.flags[5] == Flag.LOST_BEFORE
    with pytest.raises(UnknownName, match="no channel 'y'"):
        stream.channel("y")
    with pytest.raises(UnusableInput, match="one stream"):
        Stream.from_chunks([], 1.0)


def test_one_clock_for_both() -> None:
    drive, sensor = record(sine(20.0), DeviceClock(offset=123e-6), n=4096)
    told = align(
        drive, Stream.of(RATE, x=sensor.channels["x"]),
        ClockWiring(shared_clock=True, delay=123e-6, delay_error=1e-7),
    )  # fmt: skip
    assert told.ratio == 1.0
    assert told.delay_known
    assert "one clock" in told.sentence
    by_copy = align(drive, sensor, ClockWiring(shared_clock=True, lag=LAG))
    assert abs(by_copy.map.delay - 123e-6) < 1e-6
    assert by_copy.ratio == 1.0
    assert not align(
        drive, Stream.of(RATE, x=sensor.channels["x"]), ClockWiring(shared_clock=True)
    ).delay_known


def test_what_is_refused() -> None:
    drive, sensor = record(sine(20.0), DeviceClock(), n=4096, length=False)
    flat = Stream.of(RATE, V=np.full(5000, 3.0))
    with pytest.raises(UnusableInput, match="nothing marks the time"):
        align(flat, sensor)
    noise = np.random.default_rng(0).standard_normal(4096)
    with pytest.raises(UnusableInput, match="follows the drive"):
        align(drive, Stream.of(RATE, V_copy=noise))
    with pytest.raises(UnusableInput, match="neither"):
        align(drive, Stream.of(RATE, y=noise))
    with pytest.raises(UnusableInput, match="give seconds or width"):
        Budget()
    with pytest.raises(UnusableInput, match="cannot drift"):
        ClockWiring(shared_clock=True, drifting=True)
