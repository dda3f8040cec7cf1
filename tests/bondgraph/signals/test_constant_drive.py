"""A drive that is constant drives all the same: what moves meanwhile is no rest, and no noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from bondgraph.signals.recording import Recording
from bondgraph.signals.split import default_split
from bondgraph.support.arrays import FloatArray
from identification.study.noise_floor import read_noise

N, FS = 3000, 500.0
T = np.arange(N) / FS


def recorded(speed: FloatArray, first: float, noise: float = 0.2) -> Recording:
    levels = np.repeat(np.random.default_rng(5).uniform(4.0, 8.0, 40), 50)
    u = np.concatenate([np.full(N - levels.size, first), first + levels])
    w = speed + noise * np.random.default_rng(2).standard_normal(N)
    return Recording.from_arrays("motor", {"U[V]": u, "w[rad/s]": w}, fs=FS)


def moved() -> FloatArray:
    return np.where(T < 2.0, 0.0, 20.0 * np.sin(2 * np.pi * 1.3 * (T - 2.0)))


def test_a_run_up_at_a_constant_command_is_scored_and_tells_no_noise() -> None:
    run_up = recorded(50.0 * (1 - np.exp(-T / 0.4)) + moved(), first=3.0)
    split = default_split(run_up, drive="U")
    assert split.rest is None
    assert (split.train.start, split.rule.count("rest")) == (0, 0)  # type: ignore[union-attr]
    ((level, measured),) = read_noise(run_up, split, ("w",), ("U",)).values()
    assert not measured
    assert level == pytest.approx(0.2, rel=0.3)


@pytest.mark.parametrize("first", [0.0, 3.0])
def test_a_rest_under_any_command_is_one_and_tells_the_noise(first: float) -> None:
    rest = recorded(moved(), first)
    split = default_split(rest, drive="U")
    assert split.rest is not None
    assert split.rest.stop >= 1000
    ((level, measured),) = read_noise(rest, split, ("w",), ("U",)).values()
    assert measured
    assert level == pytest.approx(0.2, rel=0.1)


def test_what_the_model_has_not_may_move_in_a_rest() -> None:
    rest = recorded(moved(), 3.0)
    warming = Recording.from_arrays(
        "warming", {"U[V]": rest["U"], "w[rad/s]": rest["w"], "T[K]": 293.0 + T}, fs=FS
    )
    assert default_split(warming, drive="U").rest is None
    assert default_split(warming, drive="U", watched=("U", "w")).rest is not None


def test_slow_noise_in_a_rest_is_no_motion() -> None:
    slow = lfilter([1.0], [1.0, -0.97], np.random.default_rng(1).standard_normal(N))
    rest = recorded(moved() + 0.4 * slow, 3.0)
    assert default_split(rest, drive="U").rest is not None


def test_what_dies_away_in_the_first_half_of_a_rest_is_no_noise() -> None:
    dying = recorded(moved() + 8.0 * np.exp(-T / 0.2) * np.sin(2 * np.pi * 9.0 * T), 3.0)
    split = default_split(dying, drive="U")
    assert split.rest is not None
    ((level, measured),) = read_noise(dying, split, ("w",), ("U",)).values()
    assert measured
    assert level == pytest.approx(0.2, rel=0.1)


def test_what_swings_far_above_the_noise_in_a_rest_is_no_noise() -> None:
    """Its means stand still: a ripple at a constant speed."""
    ripple = np.where(T < 2.0, 5.0 * np.sin(2 * np.pi * 40.0 * T), 0.0)
    seen = recorded(ripple + 5.0 * moved(), first=3.0)
    split = default_split(seen, drive="U")
    assert split.rest is not None
    ((level, measured),) = read_noise(seen, split, ("w",), ("U",)).values()
    assert not measured
    assert level == pytest.approx(0.2, rel=0.3)
