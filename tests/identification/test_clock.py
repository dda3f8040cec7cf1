"""Two clocks: false thickness, estimates with intervals that hold, what cannot be told apart."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from actuators.stack.loop_width import loop_of
from bondgraph import Recording
from bondgraph.hysteresis import AlJanaideh
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.clock import (
    ClockMap,
    ratio_basis,
    resampled,
    synchronised,
    thickness_from_misfit,
)
from identification.clock_fit import clock_from_fit
from identification.clock_phase import clock_from_phase, delay_from_lags

STACK = AlJanaideh.stack_2hz()
RATE = 3125.0
SKEW = ClockMap((37e-6,))


def cosine(t: np.ndarray, f: float) -> np.ndarray:
    return np.asarray(50 - 50 * np.cos(2 * np.pi * f * np.maximum(t, 0.0)))


def many(t: np.ndarray) -> np.ndarray:
    s = np.maximum(t, 0.0)[:, None]
    f, size = np.array([1.37, 5.11, 13.7, 31.3]), np.array([20.0, 14.0, 8.0, 6.0])
    return np.asarray(50 + np.sin(2 * np.pi * f * s) @ size)


def lagging(volt: np.ndarray, step: float, tau: float) -> np.ndarray:
    """Operator behind a first-order lag: the loop widens with frequency."""
    from scipy.signal import lfilter

    a = np.exp(-step / tau)
    slow = lfilter([0.5 * (1 - a), 0.5 * (1 - a)], [1.0, -a], volt - volt[0]) + volt[0]
    return np.asarray(STACK.run(slow)[0])


def seen(
    clock: ClockMap, f: float, n: int = 8192, noise: float = 2e-9, seed: int = 0, tau: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nominal time, command and the displacement that a sensor with another clock takes."""
    time = np.arange(n) / RATE
    at = clock.to_drive(time)
    if tau:
        fine = np.linspace(0.0, float(at[-1]), 16 * n)
        x = np.interp(at, fine, lagging(cosine(fine, f), float(fine[1]), tau))
    else:
        x = STACK.run(cosine(at, f))[0]
    x = x + noise * np.random.default_rng(seed).standard_normal(n)
    return time, cosine(time, f), x


def thickness(time: np.ndarray, x: np.ndarray, f: float) -> float:
    """Thickness of the last whole loop."""
    end = float(time[-1]) - 20 / RATE
    at = end - 1 / f + np.arange(1000) / 1000 / f
    return loop_of(cosine(at, f), resampled(time, x, at)).thickness


@pytest.mark.parametrize(
    ("f", "ppm", "nanometres"),
    [(2.0, 100, 58), (2.0, 1, 0.58), (10.0, 100, 289), (100.0, 10, 290), (100.0, 100, 2695)],
)
def test_false_thickness_formula(f: float, ppm: float, nanometres: float) -> None:
    stroke, misfit = 4.4e-6, ppm * 1e-6 * 10.49
    wanted = thickness_from_misfit(stroke, f, misfit)
    assert 1e9 * wanted == pytest.approx(nanometres, rel=0.01)
    t = np.arange(4000) / 4000 / f
    loop = loop_of(cosine(t, f), stroke / 100 * (50 - 50 * np.cos(2 * np.pi * f * (t + misfit))))
    assert abs(loop.thickness) == pytest.approx(wanted, rel=2e-3)


def test_map_and_its_inverse() -> None:
    knots = (0.0, 4.0, 10.0)
    clock = ClockMap((-60e-6, 20e-6, 90e-6), knots, 3e-4)
    time = np.linspace(0.0, 11.0, 200)

    def ratio(s: float) -> float:
        return float(np.interp(s, knots, clock.ratio))

    wanted = 3e-4 + quad(ratio, 0.0, 7.3, points=[4.0])[0]
    assert float(clock.misfit(7.3)) == pytest.approx(wanted, rel=1e-9)
    assert np.abs(clock.to_sensor(clock.to_drive(time)) - time).max() < 1e-13
    assert np.all(np.diff(clock.to_drive(time)) > 0)
    assert ratio_basis(time).shape == (200, 1)
    assert ratio_basis(time, knots).sum(axis=1) == pytest.approx(time, abs=1e-9)


@pytest.mark.parametrize(
    ("ratio", "knots", "match"),
    [
        ((), (), "ratios need"),
        ((0.0, 1e-6), (0.0,), "as many knots"),
        ((0.0, 1e-6), (1.0, 1.0), "must increase"),
        ((-1.5,), (), "backwards"),
        ((float("nan"),), (), "backwards"),
    ],
)
def test_maps_that_are_none(ratio: tuple[float, ...], knots: tuple[float, ...], match: str) -> None:
    with pytest.raises(UnusableInput, match=match):
        ClockMap(ratio, knots)


def test_resampling_is_band_limited() -> None:
    t = np.arange(400) / 1000.0
    at = np.linspace(0.05, 0.35, 777)
    for f, sinc, cubic in ((50.0, 1e-4, 1e-3), (300.0, 5e-3, 0.5)):
        wave = np.sin(2 * np.pi * f * t)
        true = np.sin(2 * np.pi * f * at)
        assert np.abs(resampled(t, wave, at) - true).max() < sinc
        assert np.abs(resampled(t, wave, at, "cubic") - true).max() < cubic
    assert np.abs(resampled(t, wave, t) - wave).max() < 1e-12
    with pytest.raises(UnusableInput, match="outside"):
        resampled(t, wave, [0.5])
    with pytest.raises(UnusableInput, match="'nearest'"):
        resampled(t, wave, at, "nearest")


@pytest.mark.parametrize("f", [2.0, 10.0, 100.0])
@pytest.mark.parametrize("tau", [0.0, 0.3e-3])
def test_phase_gives_the_ratio_and_the_width_back(f: float, tau: float) -> None:
    """With and without rate dependence; the rate dependence itself stays."""
    clock = ClockMap((-150e-6,))
    time, u, x = seen(clock, f, 16384, tau=tau)
    _, _, equal = seen(ClockMap((0.0,)), f, 16384, tau=tau)
    found = clock_from_phase(time, u, x)
    low, high = found.ratio_ci95[0]
    assert low - 0.3e-6 < -150e-6 < high + 0.3e-6
    assert high - low < 5e-6
    assert found.frequency == pytest.approx(f, rel=1e-7)
    recording = Recording.from_arrays("skewed", {"t_s": time, "V_in[V]": u, "x[m]": x})
    mended = synchronised(recording, found.clock)
    true = thickness(time, equal, f)
    assert abs(thickness(time, x, f) - true) > 5e-9 * f
    assert thickness(mended.time, mended["x"], f) == pytest.approx(true, abs=6e-9)
    if tau and f == 100.0:
        assert true > 1.8 * thickness(time, seen(ClockMap((0.0,)), f, 16384)[2], f)


def test_phase_intervals_cover() -> None:
    hits = sum(
        low <= 37e-6 <= high
        for seed in range(60)
        for low, high in clock_from_phase(*seen(SKEW, 10.0, 4096, 5e-9, seed)).ratio_ci95
    )
    assert hits >= 53


def test_drifting_ratio() -> None:
    knots = (0.0, 2.5, 5.2)
    clock = ClockMap((-60e-6, 20e-6, 90e-6), knots)
    time, u, x = seen(clock, 100.0, 16384)
    found = clock_from_phase(time, u, x, knots=knots)
    assert np.abs(found.clock.misfit(time) - clock.misfit(time)).max() < 1e-6
    assert np.all(found.ratio_ci95[:, 1] - found.ratio_ci95[:, 0] < 2e-6)
    straight = clock_from_phase(time, u, x)
    assert np.abs(straight.clock.misfit(time) - clock.misfit(time)).max() > 2e-5


def test_delay_and_lag_are_one_phase() -> None:
    """A later start looks like a smaller lag; neither the ratio nor the residual notices."""
    plain = clock_from_phase(*seen(SKEW, 10.0))
    late = clock_from_phase(*seen(ClockMap((37e-6,), (), 160e-6), 10.0))
    assert late.lag == pytest.approx(plain.lag - 160e-6, abs=2e-6)
    assert late.clock.ratio[0] == pytest.approx(plain.clock.ratio[0], abs=0.2e-6)
    assert late.clock.delay == 0.0
    assert "cannot be told apart" in str(late)


def test_frequencies_tell_delay_from_hysteresis_only_without_rate() -> None:
    late = ClockMap((37e-6,), (), 160e-6)
    fs = [2.0, 10.0, 100.0]
    for tau, good in ((0.0, True), (0.3e-3, False)):
        lags = [clock_from_phase(*seen(late, f, 16384, tau=tau)).lag for f in fs]
        delay, phase = delay_from_lags(fs, lags)
        assert (abs(delay - 160e-6) < 5e-6) is good
        if good:
            assert phase == pytest.approx(0.152, abs=0.005)
        else:
            assert delay == pytest.approx(160e-6 - tau, abs=20e-6)
    with pytest.raises(UnusableInput, match="two different"):
        delay_from_lags([2.0, 2.0], [1.0, 1.0])


def test_phase_refusals() -> None:
    time, u, x = seen(SKEW, 2.0)
    with pytest.raises(UnusableInput, match="command is constant"):
        clock_from_phase(time, np.full(time.size, 50.0), x)
    with pytest.raises(UnusableInput, match="displacement is constant"):
        clock_from_phase(time, u, 0 * x)
    short = slice(0, 3400)
    with pytest.raises(UnusableInput, match="periods of 2 Hz after settling"):
        clock_from_phase(time[short], u[short], x[short])
    tiny = slice(0, 2500)
    with pytest.raises(UnusableInput, match="record at least 2"):
        clock_from_phase(time[tiny], u[tiny], x[tiny])
    with pytest.raises(UnusableInput, match="fewer knots"):
        clock_from_phase(time, u, x, knots=tuple(np.linspace(0, 2.6, 9).tolist()))
    with pytest.raises(UnusableInput, match="use clock_from_fit"):
        clock_from_phase(time, u, x, frequency=2.01)
    with pytest.raises(UnusableInput, match="NaN"):
        clock_from_phase(time, u, np.where(time > 1, np.nan, x))
    with pytest.raises(UnusableInput, match="one length"):
        clock_from_phase(time, u, x[:-1])


def free(clock: ClockMap, n: int = 16384) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    time = np.arange(n) / RATE
    fine = np.linspace(-0.01, float(clock.to_drive(time[-1])) + 0.01, 12 * n)
    x = np.interp(clock.to_drive(time), fine, STACK.run(many(fine))[0])
    return time, many(time), x + 2e-9 * np.random.default_rng(0).standard_normal(n)


@pytest.mark.parametrize(
    "clock",
    [
        ClockMap((100e-6,)),
        ClockMap((-37e-6,), (), 160e-6),
        ClockMap((-60e-6, 20e-6, 90e-6), (0.0, 2.5, 5.2), -900e-6),
    ],
)
def test_fit_to_a_command_without_period(clock: ClockMap) -> None:
    time, u, x = free(clock)
    known = clock_from_fit(time, u, x, knots=clock.knots, model=lambda v: STACK.run(v)[0])
    assert known.delay_determined
    assert known.rms == pytest.approx(2e-9, rel=0.03)
    assert np.abs(known.clock.misfit(time) - clock.misfit(time)).max() < 8e-6
    assert known.clock.delay == pytest.approx(clock.delay, abs=5e-6)
    plays = clock_from_fit(time, u, x, knots=clock.knots)
    assert plays.delay_determined
    assert np.abs(plays.clock.misfit(time) - clock.misfit(time)).max() < 15e-6
    for estimate in (known, plays):
        wide = estimate.ratio_ci95[:, 1] - estimate.ratio_ci95[:, 0]
        off = np.abs(np.array(estimate.clock.ratio) - np.array(clock.ratio))
        assert np.all(off < 1.5 * wide)


def test_fit_knows_when_hysteresis_imitates_the_delay() -> None:
    time, u, x = seen(ClockMap((37e-6,), (), 160e-6), 100.0)
    found = clock_from_fit(time, u, x, settle=0.01)
    assert not found.delay_determined
    assert "not determined" in str(found)
    assert found.clock.ratio[0] == pytest.approx(37e-6, abs=0.5e-6)


def test_fit_refusals() -> None:
    time, u, x = free(SKEW, 4096)
    with pytest.raises(UnusableInput, match="constant"):
        clock_from_fit(time, 0 * u, x)
    with pytest.raises(UnusableInput, match="does not follow"):
        clock_from_fit(time, u, np.random.default_rng(0).standard_normal(time.size))
    with pytest.raises(UnusableInput, match="too few for misfits"):
        clock_from_fit(time[:100], u[:100], x[:100])
    with pytest.raises(UnusableInput, match="shorten it"):
        clock_from_fit(time, u, x, settle=1.2)
    with pytest.raises(UnusableInput, match="one length"):
        clock_from_fit(time, u, x[1:])
    with pytest.raises(UnusableInput, match="NaN"):
        clock_from_fit(time, u, np.where(time > 1, np.inf, x))


def test_synchronised_recording_keeps_the_drive_and_says_so() -> None:
    time, u, x = seen(ClockMap((100e-6,), (), 1e-3), 10.0)
    arrays = {"t_s": time, "V_in[V]": u, "x[m]": x}
    recording = Recording.from_arrays("skewed", arrays)
    moved = synchronised(recording, ClockMap((100e-6,), (), 1e-3))
    first = int(np.searchsorted(time, moved.time[0] - 1e-9))
    assert first == 4
    assert np.array_equal(moved["V_in"], u[first : first + moved.n])
    wanted = STACK.run(cosine(moved.time, 10.0))[0]
    late = slice(700, moved.n - 40)
    assert np.std(moved["x"][late] - wanted[late]) < 3e-9
    assert "1000 us at the start" in moved.notes[-1]
    with pytest.raises(UnknownName):
        synchronised(recording, SKEW, sensors=("y",))
    with pytest.raises(UnusableInput, match="no time in common"):
        synchronised(recording, ClockMap((0.0,), (), 100.0))
