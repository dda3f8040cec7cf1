"""A smooth drive and the length alone: ratio, bends, lag, a known plant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import lfilter

from actuators.stack.loop_width import loop_of
from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.synchrony import (
    ClockWiring,
    Stream,
    TimeMap,
    align,
    align_by_length,
    between,
    delay_from_lags,
    false_width,
    merged,
)
from tests.hardware.synchrony.bench import RATE, STACK, many

SMOOTH = ClockWiring(hold="linear", lag=0.0)
SKEW = TimeMap(skew=37e-6)
LATE = TimeMap(160e-6, 37e-6)


def kinked(knots: tuple[float, ...], ratio: tuple[float, ...], delay: float = 0.0) -> TimeMap:
    """Return the map of a ratio that is linear between three knots."""
    first, second = np.diff(ratio) / np.diff(knots)
    return TimeMap(delay, ratio[0], float(first), ((knots[1], float(second - first)),))


def cosine(t: Array, f: float) -> Array:
    return np.asarray(50 - 50 * np.cos(2 * np.pi * f * np.maximum(t, 0.0)))


def triangle(t: Array) -> Array:
    return np.asarray(100.0 - 100.0 * np.abs(1.0 - np.maximum(t, 0.0) % 2.0))


def lagging(volt: Array, step: float, tau: float) -> Array:
    """Operator behind a first-order lag: the loop widens with frequency."""
    a = np.exp(-step / tau)
    slow = lfilter([0.5 * (1 - a), 0.5 * (1 - a)], [1.0, -a], volt - volt[0]) + volt[0]
    return np.asarray(STACK.run(slow)[0])


def seen(
    clock: TimeMap, f: float, n: int = 8192, noise: float = 2e-9, seed: int = 0, tau: float = 0.0
) -> tuple[Stream, Stream]:
    """Drive and the displacement that a sensor with another clock takes."""
    time = np.arange(n) / RATE
    at = clock.to_drive(time)
    if tau:
        fine = np.linspace(0.0, float(at[-1]), 16 * n)
        x = np.interp(at, fine, lagging(cosine(fine, f), float(fine[1]), tau))
    else:
        x = STACK.run(cosine(at, f))[0]
    x = x + noise * np.random.default_rng(seed).standard_normal(n)
    return Stream.of(RATE, V=cosine(time, f)), Stream.of(RATE, x=x)


def free(clock: TimeMap, n: int = 16384) -> tuple[Stream, Stream]:
    """Return the same for a command without a period."""
    time = np.arange(n) / RATE
    fine = np.linspace(-0.01, float(clock.to_drive(time[-1])) + 0.01, 12 * n)
    x = np.interp(clock.to_drive(time), fine, STACK.run(many(np.maximum(fine, 0.0)))[0])
    x = x + 2e-9 * np.random.default_rng(0).standard_normal(n)
    return Stream.of(RATE, V=many(time)), Stream.of(RATE, x=x)


def thickness(time: Array, x: Array, f: float) -> float:
    """Thickness of the last whole loop."""
    at = float(time[-1]) - 20 / RATE - 1 / f + np.arange(1000) / 1000 / f
    position = (at - time[0]) * (time.size - 1) / (time[-1] - time[0])
    return loop_of(
        cosine(at, f), between(x, np.zeros(x.size, np.uint16), position).values
    ).thickness


def apart(one: TimeMap, other: TimeMap, time: Array) -> float:
    return float(np.abs(one.to_drive(time) - other.to_drive(time)).max())


@pytest.mark.parametrize(("f", "ppm"), [(2.0, 100), (2.0, 1), (10.0, 100), (100.0, 10)])
def test_false_width_is_that_of_a_shifted_sine(f: float, ppm: float) -> None:
    stroke, misfit = 4.4e-6, ppm * 1e-6 * 10.49
    t = np.arange(4000) / 4000 / f
    loop = loop_of(cosine(t, f), stroke / 100 * (50 - 50 * np.cos(2 * np.pi * f * (t + misfit))))
    assert abs(loop.thickness) == pytest.approx(false_width(stroke, f, misfit), rel=2e-3)


def test_a_map_that_bends_and_its_inverse() -> None:
    knots, ratio = (0.0, 4.0, 10.0), (-60e-6, 20e-6, 90e-6)
    clock = kinked(knots, ratio, 3e-4)
    time = np.linspace(0.0, 11.0, 200)
    wanted = (
        7.3 + 3e-4 + quad(lambda s: float(np.interp(s, knots, ratio)), 0.0, 7.3, points=[4.0])[0]
    )
    assert float(clock.to_drive(7.3)) == pytest.approx(wanted, rel=1e-12)
    assert clock.skew_at(knots) == pytest.approx(ratio)
    assert np.abs(clock.columns(time) @ clock.numbers + time - clock.to_drive(time)).max() < 1e-14
    assert np.abs(clock.to_sensor(clock.to_drive(time)) - time).max() < 1e-13
    with pytest.raises(UnusableInput, match="backwards within"):
        TimeMap(bends=((1.0, -1.0),)).to_sensor([5.0])
    with pytest.raises(UnusableInput, match="not finite"):
        TimeMap(bends=((1.0, float("nan")),))


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"knots": (1.0,)}, "drifting=True"),
        ({"knots": (1.0, 1.0), "drifting": True}, "increase"),
        ({"knots": (float("nan"),), "drifting": True}, "finite"),
    ],
)
def test_knots_that_are_none(arguments: dict[str, object], match: str) -> None:
    with pytest.raises(UnusableInput, match=match):
        ClockWiring(**arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("f", [2.0, 10.0, 100.0])
@pytest.mark.parametrize("tau", [0.0, 0.3e-3])
def test_one_tone_gives_the_ratio_and_the_width_back(f: float, tau: float) -> None:
    """With and without rate dependence; the rate dependence itself stays."""
    drive, sensor = seen(TimeMap(skew=-150e-6), f, 16384, tau=tau)
    _, equal = seen(TimeMap(), f, 16384, tau=tau)
    found = align(drive, sensor, SMOOTH)
    assert found.how == "phase"
    low, high = found.skew_interval
    assert low - 0.3e-6 < -150e-6 < high + 0.3e-6
    assert high - low < 5e-6
    mended = merged(drive, sensor, found)
    true = thickness(equal.time, equal.channels["x"], f)
    assert abs(thickness(sensor.time, sensor.channels["x"], f) - true) > 5e-9 * f
    assert thickness(mended.time, mended.channels["x"], f) == pytest.approx(true, abs=6e-9)
    if tau and f == 100.0:
        without = seen(TimeMap(), f, 16384)[1]
        assert true > 1.8 * thickness(without.time, without.channels["x"], f)


def test_intervals_of_ratio_and_lag_cover() -> None:
    exact = align(*seen(TimeMap(), 10.0, 16384, 1e-13), SMOOTH).answer_lag
    hits = np.zeros(2, int)
    for seed in range(60):
        found = align(*seen(SKEW, 10.0, 4096, 5e-9, seed), SMOOTH)
        low, high = found.skew_interval
        hits += (
            low <= 37e-6 <= high,
            abs(found.answer_lag - exact) <= found.factor * found.answer_lag_error,
        )
    assert hits.min() >= 53


def test_a_ratio_that_bends() -> None:
    clock = kinked((0.0, 2.5, 5.2), (-60e-6, 20e-6, 90e-6))
    drive, sensor = seen(clock, 100.0, 16384)
    wiring = ClockWiring(hold="linear", lag=0.0, drifting=True, knots=(2.5,))
    found = align(drive, sensor, wiring)
    assert apart(found.map, clock, sensor.time) < 1e-6
    assert np.all(2.0 * found.skew_half_at([0.0, 2.5, 5.2]) < 2e-6)
    assert apart(align(drive, sensor, SMOOTH).map, clock, sensor.time) > 2e-5
    only_drift = align(drive, sensor, ClockWiring(hold="linear", lag=0.0, drifting=True))
    assert apart(only_drift.map, clock, sensor.time) > 2e-6


def test_delay_and_lag_are_one_phase() -> None:
    """A later start looks like a smaller lag; neither the ratio nor the residual notices."""
    plain, late = (align(*seen(clock, 10.0), SMOOTH) for clock in (SKEW, LATE))
    assert late.answer_lag == pytest.approx(plain.answer_lag - 160e-6, abs=2e-6)
    assert late.map.skew == pytest.approx(plain.map.skew, abs=0.2e-6)
    assert late.map.delay == 0.0
    assert not late.delay_known
    assert "are one phase" in str(late)


def test_frequencies_tell_delay_from_hysteresis_only_without_rate() -> None:
    fs = [2.0, 10.0, 100.0]
    for tau, good in ((0.0, True), (0.3e-3, False)):
        lags = [align(*seen(LATE, f, 16384, tau=tau), SMOOTH).answer_lag for f in fs]
        delay, phase = delay_from_lags(fs, lags)
        assert (abs(delay - 160e-6) < 5e-6) is good
        if good:
            assert phase == pytest.approx(0.152, abs=0.005)
        else:
            assert delay == pytest.approx(160e-6 - tau, abs=20e-6)
    with pytest.raises(UnusableInput, match="two different"):
        delay_from_lags([2.0, 2.0], [1.0, 1.0])


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize(
    "clock",
    [
        TimeMap(skew=100e-6),
        TimeMap(160e-6, -37e-6),
        kinked((0.0, 2.5, 5.2), (-60e-6, 20e-6, 90e-6), -900e-6),
    ],
)
def test_a_command_without_period(clock: TimeMap) -> None:
    drive, sensor = free(clock)
    bends = {"drifting": True, "knots": (2.5,)} if clock.bends else {}
    wiring = ClockWiring(hold="linear", lag=0.0, plant_lag_error=0.0, **bends)  # type: ignore[arg-type]
    known = align_by_length(drive, sensor, wiring, model=lambda v: STACK.run(v)[0])
    assert known.delay_known
    assert known.rms == pytest.approx(2e-9, rel=0.03)
    assert apart(known.map, clock, sensor.time) < 8e-6
    assert known.map.delay == pytest.approx(clock.delay, abs=5e-6)
    plays = align(drive, sensor, wiring)
    assert plays.delay_known
    assert apart(plays.map, clock, sensor.time) < 15e-6
    for found in (known, plays):
        off = np.abs(found.map.skew_at([0.0, 2.5, 5.2]) - clock.skew_at([0.0, 2.5, 5.2]))
        assert np.all(off < 3.0 * found.skew_half_at([0.0, 2.5, 5.2]))


def test_what_is_refused() -> None:
    drive, sensor = seen(SKEW, 2.0)
    flat = Stream.of(RATE, V=np.full(8192, 50.0))
    with pytest.raises(UnusableInput, match="nothing marks the time"):
        align(flat, sensor, SMOOTH)
    short = Stream.of(RATE, x=sensor.channels["x"][:3400])
    with pytest.raises(UnusableInput, match="fewer than 2 periods"):
        align(drive, short, SMOOTH)
    drive, sensor = free(SKEW, 4096)
    noise = Stream.of(RATE, x=np.random.default_rng(0).standard_normal(4096))
    with pytest.raises(UnusableInput, match="follows the drive"):
        align(drive, noise, SMOOTH)
    few = Stream.of(RATE, x=sensor.channels["x"][:100])
    with pytest.raises(UnusableInput, match="too few"):
        align(drive, few, SMOOTH)


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize(("volt", "delay", "told"), [(triangle, 0.0, False), (many, 3e-3, True)])
def test_a_delay_far_beyond_what_the_trigger_allows_is_not_printed(
    volt: Callable[[Array], Array], delay: float, told: bool
) -> None:
    time = np.arange(8192) / RATE
    clock = TimeMap(delay, 20e-6)
    fine = np.linspace(-0.1, float(time[-1]) + 0.1, 12 * time.size)
    answer = STACK.run(volt(np.maximum(fine, 0.0)))[0]
    x = np.interp(clock.to_drive(time), fine, answer)
    x = x + 2e-9 * np.random.default_rng(0).standard_normal(x.size)
    wiring = ClockWiring(delay_error=1.0 / (RATE * 3.0**0.5))
    found = align(Stream.of(RATE, V=volt(time)), Stream.of(RATE, x=x), wiring)
    said = " ".join(found.notes)
    assert ("cannot be told from this signal" in said) is not told
    assert ("own lag is" in said) is told
    # what the trigger says of it stays
    assert found.delay_known
    assert found.map.delay == 0.0
