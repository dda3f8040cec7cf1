"""Rate-dependent plays: causality, the always exact inverse, the fast one and its condition."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bondgraph.hysteresis import (
    BadInput,
    BadParameter,
    Inverse,
    NotInvertible,
    PrandtlIshlinskii,
)
from bondgraph.hysteresis.rate.ang_rate_dependent import AngRateDependent
from bondgraph.hysteresis.rate.closed_form_check import closed_form_check
from bondgraph.hysteresis.rate.closed_form_inverse import RateDependentClosedFormInverse
from bondgraph.hysteresis.rate.rate import measured_rate, rate_record
from bondgraph.hysteresis.rate.rate_dependent import RateDependentPrandtlIshlinskii
from bondgraph.hysteresis.rate.solve_plays import solve_plays
from bondgraph.support.ops import NUMPY

STEP = 1e-3
TRIALS = range(12)


def motion(seed: int, n: int = 500) -> np.ndarray:
    """Random motion of 20 units peak to peak with a rest, reversals and fast parts."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 2, n)
    tones = zip(rng.uniform(0.3, 1, 5), rng.uniform(0.5, 12, 5), rng.uniform(0, 6, 5), strict=True)
    x = np.sum([a * np.sin(2 * np.pi * f * t + phase) for a, f, phase in tones], axis=0)
    x[n // 3 : n // 3 + n // 20] = x[n // 3]
    return np.asarray(20.0 * x / np.ptp(x))


def random_operator(
    seed: int, gains: str, smoothing: float = 0.0
) -> RateDependentPrandtlIshlinskii:
    """Six plays, rate gains a little below the step, or below the smoothing."""
    rng = np.random.default_rng(seed + 1000)
    n = 6
    a = np.cumsum(rng.uniform(0.3, 1.0, n))
    b = {
        "common": np.full(n, rng.uniform(0.3, 0.9)),
        "growing": np.cumsum(rng.uniform(0.05, 0.15, n)),
        "proportional": 0.9 * a / a[-1],
        "falling": 0.9 * np.arange(n, 0, -1) / n,
        "any": rng.uniform(0, 0.9, n),
    }[gains] * (smoothing or STEP)
    weights = rng.uniform(0.1, 1.0, n + 1)
    operator = RateDependentPrandtlIshlinskii((0, *a), (0, *b), tuple(weights), smoothing)
    assert operator.error_gain(STEP) < 0.9
    return operator


def test_forward_is_the_formula() -> None:
    operator = random_operator(0, "any")
    x = motion(0, 400)
    a, b = np.array(operator.thresholds[1:]), np.array(operator.rate_gains[1:])
    last, rate, states, expected = x[0], 0.0, np.clip(0.0, x[0] - a, x[0] + a), []
    for value in x:
        r = a + b * abs(rate)
        states = np.clip(states, value - r, value + r)
        rate, last = (value - last) / STEP, value
        expected.append(operator.weights[0] * value + np.dot(operator.weights[1:], states))
    np.testing.assert_allclose(operator.run(x, step=STEP)[0], expected, rtol=1e-12, atol=1e-12)


def test_slow_motion_is_the_operator_without_rate() -> None:
    operator = random_operator(1, "any")
    x = motion(1)
    still, _ = PrandtlIshlinskii(operator.thresholds, operator.weights).run(x)
    slow, _ = operator.run(x, step=1e9)
    fast, _ = operator.run(x, step=STEP)
    np.testing.assert_allclose(slow, still, atol=1e-9)
    assert np.max(np.abs(fast - still)) > 0.03 * np.ptp(still)


def test_loops_widen_with_the_rate() -> None:
    operator = RateDependentPrandtlIshlinskii((0, 0.5, 1), (0, 2e-3, 2e-3), (1, 0.4, 0.4))
    x = 5.0 * np.sin(2 * np.pi * np.arange(3001) / 1000)
    areas = []
    for step in (1e-2, 1e-4, 2e-5):
        y, _ = operator.run(x, step=step)
        areas.append(abs(float(np.trapezoid(y[2000:], x[2000:]))))
    assert areas[0] < 0.9 * areas[1] < 0.8 * areas[2]


def test_output_rises_with_the_trial_input_however_short_the_step() -> None:
    """The reason for the causal rate: b_i > h would make the output fall with its input."""
    operator = RateDependentPrandtlIshlinskii((0, 0.5), (0, 1.0), (0.1, 1.0))
    trial = np.linspace(-3, 3, 601)
    for rate in (0.0, 1.0, 50.0):
        assert np.all(np.diff(operator.value(NUMPY, trial, (0.0, rate, -2.0), STEP)) > 0)
    width_inside = 0.5 + 1.0 * np.abs(trial - 0.0) / STEP
    inside = 0.1 * trial + np.clip(-2.0, trial - width_inside, trial + width_inside)
    assert np.min(np.diff(inside)) < -1.0


@pytest.mark.parametrize("negative", [False, True])
def test_solve_is_exact_for_any_state_and_any_widths(negative: bool) -> None:
    rng = np.random.default_rng(3)
    worst = 0.0
    for _ in range(300):
        n = int(rng.integers(0, 9))
        w = rng.uniform(0.05, 1.0, n + 1)
        if negative and n:
            w[0] = 1.0
            w[1:] *= rng.choice([-0.9 / n, 1.0], n)
        states, widths = rng.uniform(-3, 3, n), rng.uniform(0, 4, n)
        if n > 2:
            states[1], widths[1] = states[0], widths[0]  # corners that coincide
        x = np.concatenate((rng.uniform(-8, 8, 40), states - widths, states + widths))
        y = w[0] * x + np.clip(states[:, None], x - widths[:, None], x + widths[:, None]).T @ w[1:]
        found = solve_plays(NUMPY, y, tuple(w.tolist()), tuple(widths.tolist()), tuple(states))
        worst = max(worst, float(np.max(np.abs(found - x)) / np.max(np.abs(x))))
    print(f"largest relative error of the solve: {worst:.1e}")
    assert worst < 1e-14


@pytest.mark.parametrize("gains", ["common", "growing", "proportional", "falling", "any"])
@pytest.mark.parametrize("smoothing", [0.0, 0.01, 0.1])
def test_general_inverse_is_always_exact(gains: str, smoothing: float) -> None:
    for seed in range(4):
        operator = random_operator(seed, gains, smoothing)
        x = motion(seed)
        _, memory = operator.run(motion(seed + 20, 500), step=STEP)
        y, after = operator.run(x, memory, step=STEP)
        back, after_back = operator.inverse().run(y, memory, step=STEP)
        assert np.max(np.abs(back - x)) < 2e-14 * np.ptp(x)
        np.testing.assert_allclose(after_back, after, rtol=1e-9, atol=1e-9)


def faster_and_faster(seed: int, n: int = 500) -> np.ndarray:
    """Speed never falls, direction changes at random."""
    rng = np.random.default_rng(seed)
    speed = np.cumsum(rng.uniform(0, 4e-3, n))
    x, direction = np.zeros(n), 1.0
    for k in range(1, n):
        if abs(x[k - 1]) > 9.0:
            direction = -np.sign(x[k - 1])
        elif rng.random() < 0.05:
            direction = -direction
        x[k] = x[k - 1] + direction * speed[k]
    return x


def closed_form_error(operator: Any, x: Any, seed: int) -> float:
    """Largest error over the range of the input, from a memory with a past and at rest."""
    past = np.append(0.5 * motion(seed + 50), x[0])
    _, memory = operator.run(past, step=1e9)
    y, _ = operator.run(x, memory, step=STEP)
    back, _ = operator.closed_form_inverse().run(y, operator.closed_form_memory(memory), step=STEP)
    exact, _ = operator.inverse().run(y, memory, step=STEP)
    assert np.max(np.abs(exact - x)) < 2e-14 * np.ptp(x)
    return float(np.max(np.abs(back - x)) / np.ptp(x))


def test_closed_form_is_exact_for_a_common_rate_term() -> None:
    errors = []
    for seed in TRIALS:
        operator = random_operator(seed, "common")
        assert closed_form_check(operator)
        errors.append(closed_form_error(operator, motion(seed), seed))
    exact = sum(error < 1e-13 for error in errors)
    print(f"common rate term: {exact} of {len(TRIALS)} exact, largest error {max(errors):.1e}")
    assert exact == len(TRIALS)


@pytest.mark.parametrize("gains", ["growing", "proportional"])
def test_closed_form_is_exact_while_no_gap_shrinks(gains: str) -> None:
    for seed in TRIALS:
        operator, x = random_operator(seed, gains), faster_and_faster(seed)
        check = closed_form_check(operator, x, step=STEP)
        assert check, check.reason
        assert closed_form_error(operator, x, seed) < 1e-13


@pytest.mark.parametrize("gains", ["falling", "proportional", "any"])
def test_closed_form_is_wrong_where_gaps_shrink(gains: str) -> None:
    errors = []
    for seed in TRIALS:
        operator, x = random_operator(seed, gains), motion(seed)
        check = closed_form_check(operator, x, step=STEP)
        assert not check
        assert check.gap is not None
        assert f"gap {check.gap}, " in check.reason
        errors.append(closed_form_error(operator, x, seed))
    wrong = sum(error > 1e-6 for error in errors)
    print(
        f"{gains}: {wrong} of {len(TRIALS)} wrong, largest error {100 * max(errors):.2f} % of range"
    )
    assert wrong >= 11
    assert max(errors) > 1e-3


def test_first_gap_is_free() -> None:
    """r_1 may shrink: with one rate gain for all plays it does whenever the motion slows down."""
    operator, x = random_operator(2, "common"), motion(2)
    rates = rate_record(x, float(x[0]), 0.0, STEP, 0.0)
    first = [operator.widths(NUMPY, rate)[0] for rate in rates]
    assert np.min(np.diff(first)) < -1e-3
    assert closed_form_check(operator, x, step=STEP)


def test_check_names_the_gap() -> None:
    operator = RateDependentPrandtlIshlinskii((0, 1, 2, 3), (0, 0.1, 0.1, 0.3), (1, 1, 1, 1))
    check = closed_form_check(operator)
    assert (check.exact, check.gap, check.sample) == (False, 2, None)
    assert "gap 2, r_3 - r_2, shrinks whenever the speed falls" in check.reason
    along = closed_form_check(operator, [0.0, 1.0, 3.0, 3.5, 3.5], step=1.0)
    # the rate 2 known after sample 2 is followed by 0.5, which acts at sample 4
    assert (along.exact, along.gap, along.sample) == (False, 2, 4)
    assert closed_form_check(operator, [0.0, 1.0, 3.0, 6.0], step=1.0)
    crossed = RateDependentPrandtlIshlinskii((0, 1, 2), (0, 0.5, 0.1), (1, 1, 1))
    memory = (0.0, 10.0, 0.0, 0.0)
    assert closed_form_check(crossed, [0.0, 1.0], memory, step=0.01).sample == 0
    with pytest.raises(BadInput, match="give step"):
        closed_form_check(operator, [0.0, 1.0])


def test_error_gain_tells_whether_errors_die_out() -> None:
    for scale, smoothing, dies in ((0.8, 0.0, True), (2.0, 0.0, False), (20.0, 0.05, True)):
        operator = RateDependentPrandtlIshlinskii(
            (0, 0.1, 0.2), (0, scale * STEP, scale * STEP), (0.1, 1.0, 1.0), smoothing
        )
        assert (operator.error_gain(STEP) < 1.0) is dies
        x = motion(1)
        y, _ = operator.run(x, step=STEP)
        memory = operator.initial_memory(float(x[0]))
        back, _ = operator.inverse().run(y, (x[0] + 1e-6, *memory[1:]), step=STEP)
        late = float(np.max(np.abs(back - x)[100:]))
        assert late < 1e-7 if dies else late > 1e-3
    # two plays of unlike gain: only the second one pays, 3 s * 1 / (1 + 1) against 4/3
    unlike = RateDependentPrandtlIshlinskii((0, 1, 2), (0, 1.0, 3.0), (1, 1, 1))
    assert unlike.error_gain(0.5) == pytest.approx(1.5 / 0.5)


def test_smoothed_rate() -> None:
    x = motion(5, 500)
    rates = rate_record(x, 0.3, 2.0, STEP, 0.02)
    rate, last, expected = 2.0, 0.3, []
    for value in x:
        rate = float(measured_rate(NUMPY, float(value), last, rate, STEP, 0.02))
        last = float(value)
        expected.append(rate)
    np.testing.assert_allclose(rates, expected, rtol=1e-10, atol=1e-10)
    # a constant rate: two half steps are one step
    half = measured_rate(NUMPY, 0.5, 0.0, 3.0, 0.5, 0.7)
    assert float(measured_rate(NUMPY, 1.0, 0.5, half, 0.5, 0.7)) == pytest.approx(
        float(measured_rate(NUMPY, 1.0, 0.0, 3.0, 1.0, 0.7)), rel=1e-14
    )
    assert measured_rate(NUMPY, 5.0, 1.0, 3.0, 0.0, 0.7) == 3.0


def test_errors_name_the_entry() -> None:
    build = RateDependentPrandtlIshlinskii
    with pytest.raises(BadParameter, match=r"rate_gains\[1\] = -1.0"):
        build((0, 1), (0, -1), (1, 1))
    with pytest.raises(BadParameter, match=r"rate_gains\[0\] = 0.5 must be 0"):
        build((0, 1), (0.5, 1), (1, 1))
    with pytest.raises(BadParameter, match="rate_gains has 1"):
        build((0, 1), (0,), (1, 1))
    with pytest.raises(BadParameter, match=r"thresholds\[2\] = 0.5 is not above"):
        build((0, 1, 0.5), (0, 0, 0), (1, 1, 1))
    with pytest.raises(BadParameter, match=r"smoothing = -1\.0"):
        build((0, 1), (0, 0), (1, 1), -1)
    # S_i = 1, 1.8, 0.3 are positive, but the second play may move without the first
    tricky = build((0, 1, 2), (0, 1, 0.1), (1.0, 0.8, -1.5))
    with pytest.raises(NotInvertible, match=r"weights\[2\] = -1.5") as caught:
        tricky.inverse()
    # the fast inverse asks for less; whether it is right is another question
    assert isinstance(tricky.closed_form_inverse(), RateDependentClosedFormInverse)
    with pytest.raises(NotInvertible, match=r"weights\[1\] = -2"):
        build((0, 1), (0, 1), (1, -2)).closed_form_inverse()
    with pytest.raises(BadParameter, match="forward must be"):
        RateDependentClosedFormInverse(PrandtlIshlinskii((0,), (1,)))  # type: ignore[arg-type]
    assert caught.value.index == 2
    with pytest.raises(BadParameter, match="forward must be"):
        Inverse(PrandtlIshlinskii((0,), (1,)))  # type: ignore[arg-type]


ANG = AngRateDependent((0, 0.5, 1.5), (1.0, 0.6, 0.4), (2e-3, -4e-3, 1e-3), smoothing=0.1)


def test_ang_slopes_are_affine_in_the_rate() -> None:
    for rate in (0.0, 30.0, -100.0):
        expected = np.cumsum(ANG.weights) + np.array(ANG.slope_gains) * abs(rate)
        np.testing.assert_allclose(np.cumsum(ANG.at_rate(NUMPY, rate).weights), expected)
    # measured on the operator itself: a fast ramp with all plays moving, after one step
    _, memory = ANG.run(np.arange(0, 5, 0.05), step=STEP)
    rise = ANG.value(NUMPY, 6.0, memory, STEP) - ANG.value(NUMPY, 5.0, memory, STEP)
    assert memory[1] > 30.0
    assert rise == pytest.approx(2.0 + 1e-3 * memory[1])


def test_ang_inverse_is_exact_below_the_rate_limit() -> None:
    for seed in TRIALS:
        x = 0.4 * motion(seed)
        _, memory = ANG.run(0.4 * motion(seed + 30, 300), step=STEP)
        y, _ = ANG.run(x, memory, step=STEP)
        back, _ = ANG.inverse(rate=350.0).run(y, ANG.inverse_memory(memory), step=STEP)
        assert np.max(np.abs(back - x)) < 1e-12


def test_ang_rate_limit_names_slope_and_rate() -> None:
    limit, i = ANG.rate_limit()
    assert (limit, i) == (400.0, 1)
    assert AngRateDependent((0, 1), (1, 1), (0, 1)).rate_limit() == (float("inf"), None)
    with pytest.raises(NotInvertible, match="S_1 reaches 0 at 400") as caught:
        ANG.inverse(rate=500.0)
    assert caught.value.index == 1
    sharp = replace(ANG, smoothing=0.0)
    inverse = sharp.inverse()
    x = np.array([0.0, 0.1, 0.7, 1.2])  # 600 per s
    y, _ = sharp.run(x, step=STEP)
    with pytest.raises(NotInvertible, match="S_1 reaches 0 at 400"):
        inverse.run(y, step=STEP)
    with pytest.raises(NotInvertible, match="at the rate 600"):
        inverse.value(NUMPY, 1.0, (0.0, 600.0, 0.0, 0.0), STEP)
    with pytest.raises(NotInvertible, match=r"weights\[1\]"):
        AngRateDependent((0, 1), (1, -2), (0, 0)).inverse()
    with pytest.raises(BadParameter, match="slope_gains has 1"):
        AngRateDependent((0, 1), (1, 1), (0,))
