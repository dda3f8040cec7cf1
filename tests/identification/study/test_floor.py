"""The noise floor, read from a recording without any model."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from bondgraph.signals.recording import Recording, Split
from identification.statistics.periods import repeats
from identification.study.noise_floor import RELATIVE_LEAST, noise_floor, read_noise

N = 4000
T = np.asarray(1e-3 * np.arange(N), np.float64)


def measured(recording: Recording, split: Split, sensors: tuple[str, ...], *more: Any) -> bool:
    """Whether the noise of all sensors was measured."""
    return all(sure for _, sure in read_noise(recording, split, sensors, *more).values())


def recorded(x: np.ndarray) -> Recording:
    return Recording("r", T[: x.size], {"x": x}, {"x": "m"})


def floor(x: np.ndarray, rest: slice | None = None) -> float:
    split = Split(
        slice(rest.stop if rest else 0, x.size // 2), slice(x.size // 2, x.size), "", rest
    )
    return noise_floor(recorded(x), split, ("x",))["x"]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_white_noise_on_a_slow_signal(seed: int) -> None:
    noise = 2e-3 * np.random.default_rng(seed).standard_normal(N)
    assert floor(np.sin(2 * np.pi * 3 * T) + noise) == pytest.approx(2e-3, rel=0.15)


def test_rest_gives_it_directly_less_a_drift() -> None:
    x = np.sin(2 * np.pi * 3 * T)
    x[:1000] = 0.3 + 0.5 * T[:1000]
    x[1000:] += 0.05 * np.random.default_rng(9).standard_normal(N - 1000)
    x[:1000] += 1e-3 * np.random.default_rng(1).standard_normal(1000)
    assert floor(x, slice(0, 1000)) == pytest.approx(1e-3, rel=0.1)


def test_rounding_of_the_converter_is_noise() -> None:
    step = 0.02
    x = step * np.round(np.sin(2 * np.pi * 0.3 * T) / step)
    assert floor(x) >= step / np.sqrt(12) * 0.999


def test_never_zero() -> None:
    x = np.sin(2 * np.pi * 3 * T)
    assert floor(x) >= RELATIVE_LEAST * x.std()
    assert floor(np.zeros(100)) > 0
    assert floor(np.array([1.0, 2.0, 3.0])) > 0


# -- repeated periods -------------------------------------------------------------------------
PERIOD = 500


def repeated(noise: np.ndarray, periods: int = 6, period: int = PERIOD) -> Recording:
    """A lag that starts from rest, driven by the same tones over and over."""
    n = period * periods
    phase = 2 * np.pi * np.arange(period) / period
    u = np.tile(
        np.sin(3 * phase) + 0.7 * np.sin(17 * phase + 1) + 0.4 * np.sin(61 * phase), periods
    )
    x = lfilter([0.05], [1.0, -0.95], u) + noise[:n]
    t = np.asarray(1e-3 * np.arange(n), np.float64)
    return Recording("r", t, {"u": u, "x": x}, {"u": "V", "x": "m"})


def level(recording: Recording, commands: tuple[str, ...] = ("u",)) -> float:
    split = Split(slice(0, 2000), slice(2000, recording.n), "")
    return noise_floor(recording, split, ("x",), commands)["x"]


def coloured(pole: float, seed: int) -> np.ndarray:
    """Noise with memory, standard deviation 2e-3, long enough for six periods."""
    white = np.random.default_rng(seed).standard_normal(6 * PERIOD + 500)
    return np.asarray(2e-3 * np.sqrt(1 - pole**2) * lfilter([1.0], [1.0, -pole], white)[500:])


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("pole", [0.0, 0.9, 0.98])
def test_periods_tell_white_and_coloured_noise(pole: float, seed: int) -> None:
    found = level(repeated(coloured(pole, seed)))
    # few independent samples lie in a period of slow noise
    assert found == pytest.approx(2e-3, rel=0.15 if pole < 0.95 else 0.5)
    if pole == 0.9:  # the top of the spectrum does not hear it
        assert level(repeated(coloured(pole, seed)), ()) < 0.5 * found


def test_noise_with_memory_is_not_read_too_low() -> None:
    # a median of mean squares of few degrees of freedom lies below their mean
    found = [level(repeated(coloured(0.9, seed))) for seed in range(24)]
    assert np.mean(found) == pytest.approx(2e-3, rel=0.02)


@pytest.mark.parametrize("left", [1, 3, 30, 150])
def test_a_record_that_ends_within_a_period_tells_its_noise(left: int) -> None:
    noise = 2e-3 * np.random.default_rng(4).standard_normal(4 * PERIOD)
    assert level(repeated(noise, 4).slice(0, 3 * PERIOD + left)) == pytest.approx(2e-3, rel=0.15)


def test_the_period_and_its_stretches() -> None:
    r = repeated(np.zeros(6 * PERIOD))
    found = repeats([np.asarray(r["u"])])
    assert found is not None
    period, runs = found
    assert period % PERIOD == 0
    assert sum(s.stop - s.start for s in runs) + period == r.n
    assert measured(r, Split(slice(0, 1), slice(1, 2), ""), ("x",), ("u",))


def test_pushes_that_do_not_come_again_are_no_noise() -> None:
    noise = 2e-3 * np.random.default_rng(5).standard_normal(6 * PERIOD)
    bare = repeated(noise)
    t = bare.time
    pushed = sum(np.exp(-(((t - c) / 0.15) ** 2)) for c in (0.3, 0.72, 1.4, 1.9, 2.3, 2.8))
    r = replace(bare, channels={**bare.channels, "x": bare["x"] + pushed})
    split = Split(slice(0, bare.n // 2), slice(bare.n // 2, bare.n), "")
    apart = level(r) / 2e-3
    assert 1.0 < apart < 40.0  # an eighth of what the pushes differ by: it might be slow noise
    assert not measured(r, split, ("x",), ("u",))
    assert measured(bare, split, ("x",), ("u",))
    # a rest tells it nevertheless
    resting = replace(split, rest=slice(0, 200))
    quiet = np.where(np.arange(bare.n) < 260, noise, bare["x"] + pushed)
    rested = replace(bare, channels={**bare.channels, "x": quiet})
    assert noise_floor(rested, resting, ("x",), ("u",))["x"] == pytest.approx(2e-3, rel=0.2)
    assert measured(rested, resting, ("x",), ("u",))


@pytest.mark.parametrize(("order", "corner"), [(1, 0.1), (2, 0.2), (2, 0.05), (4, 0.1)])
def test_noise_behind_a_filter_is_told_by_the_periods(order: int, corner: float) -> None:
    white = np.random.default_rng(5).standard_normal(8 * PERIOD + 500)
    noise = lfilter(*butter(order, corner), white)[500:]
    noise *= 2e-3 / noise.std()
    r = repeated(noise, 8)
    split = Split(slice(0, r.n // 2), slice(r.n // 2, r.n), "")
    found = level(r)
    if measured(r, split, ("x",), ("u",)):
        assert found == pytest.approx(2e-3, rel=0.25)
    else:  # then it must not be called physics: a guess may be wrong by twelve
        assert 2e-3 / 10 < found < 2.5e-3


def test_feedback_and_sweeps_do_not_repeat() -> None:
    t = np.asarray(1e-3 * np.arange(3000), np.float64)
    rng = np.random.default_rng(4)
    wanted = np.asarray(repeated(np.zeros(t.size))["u"])
    fed_back = wanted + 1e-3 * lfilter([1.0], [1.0, -0.9], rng.standard_normal(t.size))
    sweep = np.sin(2 * np.pi * (1 + 4 * t) * t)
    for u in (fed_back, sweep, rng.standard_normal(t.size), np.cumsum(rng.standard_normal(3000))):
        assert repeats([u]) is None
        r = Recording("r", t, {"u": u, "x": wanted}, {"u": "V", "x": "m"})
        assert not measured(r, Split(slice(0, 1), slice(1, 2), ""), ("x",), ("u",))
    assert repeats([wanted, fed_back]) is None
    assert repeats([wanted]) is not None


def test_a_command_that_stands_still_does_not_repeat() -> None:
    t = np.asarray(1e-3 * np.arange(3000), np.float64)
    step = np.where(t < 0.2, 0.0, 1.0)
    assert repeats([step]) is None


def test_recordings_behind_one_another_are_read_alone() -> None:
    noise = 2e-3 * np.random.default_rng(5).standard_normal(6 * PERIOD)
    one, two = repeated(noise), repeated(noise[::-1].copy())
    both = Recording(
        "both", np.asarray(1e-3 * np.arange(2 * one.n), np.float64),
        {c: np.concatenate([one[c], 5.0 + two[c]]) for c in ("u", "x")}, one.units,
    )  # fmt: skip
    split = Split(slice(0, one.n), slice(one.n, both.n), "", slice(0, 300))
    found = noise_floor(both, split, ("x",), ("u",), (one.n,))["x"]
    assert found == pytest.approx(2e-3, rel=0.15)
    assert measured(both, split, ("x",), ("u",), (one.n,))
    assert not measured(both, split, ("x",), (), (one.n,))


# -- transients, steps, jumps and coarse converters -------------------------------------------
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("periods", [3, 6])
def test_a_transient_at_the_start_of_a_periodic_record_is_no_noise(periods: int, seed: int) -> None:
    noise = 2e-3 * np.random.default_rng(seed).standard_normal(2000 * periods)
    r = repeated(noise, periods, 2000)
    fading = 5.0 * np.exp(-np.arange(r.n) / 100.0)
    begun = Recording("r", r.time, {"u": r["u"], "x": r["x"] + fading}, r.units)
    split = Split(slice(0, r.n // 2), slice(r.n // 2, r.n), "")
    assert noise_floor(begun, split, ("x",), ("u",))["x"] == pytest.approx(2e-3, rel=0.1)


def stepped(seed: int) -> np.ndarray:
    """Slow random levels and a weak multisine, seen through a lag; range about two."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.uniform(-1, 1, N // 200), 200)
    phases = rng.uniform(0, 2 * np.pi, 12)
    weak = sum(0.01 * np.sin(2 * np.pi * (3 + 4 * k) * T + p) for k, p in enumerate(phases))
    return np.asarray(levels + weak)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_slow_steps_and_a_weak_multisine_through_a_lag(seed: int) -> None:
    x = lfilter([0.05], [1.0, -0.95], stepped(seed))
    sigma = 1e-3 * np.ptp(x)
    found = floor(x + sigma * np.random.default_rng(seed + 10).standard_normal(N))
    assert 1 / 1.5 < found / sigma < 1.5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_jumps_of_a_current_are_no_noise(seed: int) -> None:
    u = stepped(seed)
    current = u - lfilter([0.05], [1.0, -0.95], u)  # jumps with the voltage, then falls
    sigma = 1e-3 * np.ptp(current)
    found = floor(current + sigma * np.random.default_rng(seed + 10).standard_normal(N))
    assert 1 / 1.5 < found / sigma < 1.5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_below_a_coarse_converter(seed: int) -> None:
    sigma = 2e-3
    unit = 2.4 * sigma
    x = np.sin(2 * np.pi * 3 * T) + sigma * np.random.default_rng(seed).standard_normal(N)
    found = floor(unit * np.round(x / unit))
    assert found == pytest.approx(np.hypot(sigma, unit / np.sqrt(12)), rel=0.4)
