"""Profiles of objectives with known shapes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.uncertainty.profile import Profile, profile, threshold_of


def walk(cost, value: float = 1.0, width: float = 0.1, **more) -> Profile:  # type: ignore[no-untyped-def]
    at = np.log(value) if more.get("log", True) else value / more.get("scale", 1.0)
    return profile(
        lambda x, s: (float(cost(x)), s), "k", value, float(cost(at)), None,
        width=width, threshold=threshold_of(), **more,
    )  # fmt: skip


@settings(max_examples=50, deadline=None)
@given(st.floats(1e-3, 1.0), st.floats(1e-4, 10.0), st.floats(0.1, 100.0))
def test_a_parabola_gives_the_normal_interval(sd: float, guess: float, value: float) -> None:
    p = walk(lambda x: 7.0 + ((x - np.log(value)) / sd) ** 2, value, guess)
    assert p.shape == "two-sided"
    half = 1.959964 * sd
    assert np.log(p.interval[0] / value) == pytest.approx(-half, rel=0.01)
    assert np.log(p.interval[1] / value) == pytest.approx(half, rel=0.01)
    assert p.better is None


def test_linear_coordinate_through_zero() -> None:
    p = walk(lambda x: (4 * x) ** 2, 0.0, 0.2, log=False, scale=5.0)
    assert p.interval == pytest.approx((-1.96 / 4 * 5, 1.96 / 4 * 5), rel=0.01)


def test_one_sided_and_flat() -> None:
    above = walk(lambda x: 30 * np.minimum(x, 0.0) ** 2)
    assert above.shape == "open above"
    assert above.interval[1] == np.inf
    assert above.interval[0] == pytest.approx(np.exp(-np.sqrt(3.841 / 30)), rel=0.02)
    below = walk(lambda x: 30 * np.maximum(x, 0.0) ** 2)
    assert below.shape == "open below"
    assert below.interval[0] == 0.0
    flat = walk(lambda x: 5.0 + 0.0 * x)
    assert flat.shape == "flat"
    assert flat.interval == (0.0, np.inf)
    assert "not determined" in str(flat)


def test_at_a_bound() -> None:
    p = walk(lambda x: (x / 0.5) ** 2, bounds=(0.9, np.inf))
    assert p.shape == "at a bound"
    assert p.interval[0] == pytest.approx(0.9)
    assert p.interval[1] == pytest.approx(np.exp(0.98), rel=0.01)


def test_two_valleys_with_a_low_hill() -> None:
    p = walk(lambda x: 2.0 * np.sin(4 * x) ** 2 + 0.05 * x**2, reach=3.0)
    assert p.shape == "multimodal"


def test_a_refit_that_stays_in_a_valley_of_the_others_makes_no_hill() -> None:
    """Going out they stay behind until it ends; the way back finds the lower one."""

    def refit(x: float, outer: bool) -> tuple[float, bool]:
        outer = outer or x < -1.5
        return (0.3 - 0.3 * x if outer else x**2), outer

    p = profile(refit, "k", 1.0, 0.0, False, width=0.1, threshold=threshold_of(), reach=3.0)
    rise = p.cost[np.log(p.grid) < 0.0]
    assert np.all(np.diff(rise) < 0.0)
    assert p.shape == "open below"


@pytest.mark.parametrize(
    ("side", "words"),
    [(-1.0, "up to 7.099; nothing keeps it from below"), (1.0, "from 0.1409 on; nothing keeps")],
)
def test_two_valleys_of_which_one_is_open(side: float, words: str) -> None:
    def cost(x: float) -> float:
        there = side * x  # open there, with a valley behind a low hill
        return 1.0 - np.cos(4 * min(there, np.pi / 2)) if there > 0 else there**2

    p = walk(cost)
    assert p.shape == "multimodal"
    assert words in str(p)


def test_the_reach_ends_a_walk_before_a_bound_behind_it() -> None:
    p = walk(lambda x: 0.0 * x, bounds=(np.exp(-1.2), np.inf), reach=1.0)
    assert (p.shape, p.interval[0]) == ("flat", 0.0)


def test_a_valley_behind_a_high_hill_is_found_beyond() -> None:
    def cost(x: float) -> float:
        return min(50 * x**2, 1.0 + 50 * (x - 2.24) ** 2)

    assert walk(cost).shape == "two-sided"
    assert walk(cost, beyond=4).shape == "multimodal"


def test_a_better_fit_is_reported() -> None:
    p = walk(lambda x: 10 + 8 * (x - 0.3) ** 2 - 5 * np.exp(-(((x - 0.9) / 0.3) ** 2)), reach=2.0)
    assert p.better is not None
    assert p.better == pytest.approx(np.exp(0.85), rel=0.1)
    assert p.drop > 1
    assert "a better fit was found" in str(p)


def test_interrupt_keeps_what_is_done() -> None:
    count = 0

    def cost(x: float) -> float:
        nonlocal count
        count += 1
        if count > 5:
            raise KeyboardInterrupt
        return (x / 0.1) ** 2

    p = walk(cost)
    assert p.status.startswith("cancelled")
    assert p.grid.size == 5


def test_the_way_back_is_cancelled_too() -> None:
    """A profile of which only a part was tried again does not call itself complete."""
    calls, most = 0, 1000

    def refit(x: float, outer: bool) -> tuple[float, bool]:
        nonlocal calls
        if calls == most:
            raise KeyboardInterrupt
        calls += 1
        outer = outer or x < -1.5
        return (0.3 - 0.3 * x if outer else x**2), outer

    whole = profile(refit, "k", 1.0, 0.0, False, width=0.1, threshold=threshold_of(), reach=3.0)
    forth = int(np.sum(whole.grid < 1.0))
    assert whole.status == "complete"
    calls, most = 0, forth
    part = profile(refit, "k", 1.0, 0.0, False, width=0.1, threshold=threshold_of(), reach=3.0)
    assert part.status.startswith("cancelled")
    assert calls == forth


def test_a_side_that_was_not_followed_to_its_end_is_not_called_open() -> None:
    p = walk(lambda x: 1e-6 * x**2, most=3)
    assert p.status.startswith("ended")
    assert "nothing keeps it" not in str(p)


def test_failing_refits_end_the_walk() -> None:
    p = walk(lambda x: np.inf if x > 0.05 else (x / 0.1) ** 2)
    assert np.isfinite(p.cost).all()
    assert p.status != "complete"


def test_thresholds() -> None:
    assert threshold_of() == pytest.approx(3.8415, abs=1e-3)
    assert threshold_of(freedom=10) == pytest.approx(4.965, abs=1e-2)
    assert threshold_of(2.0, inflation=3.0) == pytest.approx(6 * 3.8415, abs=1e-2)
    assert threshold_of(inflation=0.1) == threshold_of()
