"""Generalised Prandtl-Ishlinskii operator: envelopes, asymmetric loops, exact inverse."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from bondgraph.hysteresis.errors import BadParameter, NotInvertible
from bondgraph.hysteresis.numeric_inverse import numeric_inverse
from bondgraph.hysteresis.plays.envelope import (
    check_envelope,
    envelope,
    envelope_range,
    envelope_slope,
    inverse_envelope,
    largest_excess,
)
from bondgraph.hysteresis.plays.generalised import GeneralisedPrandtlIshlinskii
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import CASADI, NUMPY, SYMPY
from tests.bondgraph.hysteresis.checked import found_back

THRESHOLDS, WEIGHTS = (0.0, 0.3, 1.0), (1.2, 0.6, 0.4)
MIXED = (2.0, 0.6, 0.1, 0.5, -0.2)
TANGENT = (4.0, 0.25, 0.1, 0.0, -0.2)
FALLING = (-2.0, -0.6, 0.3, 0.2, 0.0)
STRAIGHT = (0.0, 0.0, 0.0, 1.7, 0.3)
LEFT, RIGHT = (2.0, 0.8, -0.2, 0.0, -0.1), (1.6, 0.9, 0.1, 0.0, 0.2)
SHAPES = pytest.mark.parametrize("shape", [MIXED, TANGENT, FALLING, STRAIGHT])
seeds = pytest.mark.parametrize("seed", range(8))


def same(shape: Any) -> GeneralisedPrandtlIshlinskii:
    return GeneralisedPrandtlIshlinskii(THRESHOLDS, WEIGHTS, shape, shape)


UNEQUAL = GeneralisedPrandtlIshlinskii(THRESHOLDS, WEIGHTS, LEFT, RIGHT)


def plays(x: Any, left: Any, right: Any, r: float) -> Any:
    """One generalised play, sample by sample on a way so dense that only one bound acts."""
    lower = left[0] * np.tanh(left[1] * x + left[2]) + left[3] * x + left[4] - r
    upper = right[0] * np.tanh(right[1] * x + right[2]) + right[3] * x + right[4] + r
    state, out = min(upper[0], max(lower[0], 0.0)), []
    for low, high in zip(lower, upper, strict=True):
        state = min(high, max(low, state))
        out.append(state)
    return np.array(out)


def test_outputs_are_weighted_generalised_plays() -> None:
    x = np.concatenate(([0.0], 3.0 * np.sin(np.linspace(0, 20, 3000))))
    mean = 0.5 * (envelope(NUMPY, x, LEFT) + envelope(NUMPY, x, RIGHT))
    expected = 1.2 * mean + 0.6 * plays(x, LEFT, RIGHT, 0.3) + 0.4 * plays(x, LEFT, RIGHT, 1.0)
    np.testing.assert_allclose(UNEQUAL.run(x)[0], expected, atol=1e-13)


@SHAPES
def test_equal_envelopes_are_plays_on_the_bent_input(shape: Any) -> None:
    x = np.random.default_rng(1).uniform(-4, 4, 300)
    operator = same(shape)
    plain = PrandtlIshlinskii(THRESHOLDS, WEIGHTS)
    memory = operator.initial_memory(float(x[0]))
    bent = np.asarray(envelope(NUMPY, x, shape))
    np.testing.assert_allclose(operator.run(x)[0], plain.run(bent, memory)[0], atol=1e-13)


def test_asymmetric_saturated_loop() -> None:
    one = np.concatenate((np.linspace(-9, 9, 2001), np.linspace(9, -9, 2001)))
    y, _ = UNEQUAL.run(one, UNEQUAL.run([9.0, -9.0])[1])
    up, down = y[:2001], y[2001:][::-1]
    # at the ends each play holds a bound: w_0 times the mean, left limit - r above, right + r below
    top = 1.2 * 0.5 * (1.9 + 1.8) + 0.6 * (1.9 - 0.3) + 0.4 * (1.9 - 1.0)
    bottom = -1.2 * 0.5 * (2.1 + 1.4) + 0.6 * (-1.4 + 0.3) + 0.4 * (-1.4 + 1.0)
    assert up[-1] == pytest.approx(top, abs=1e-5)
    assert up[0] == pytest.approx(bottom, abs=1e-5)
    assert np.all(down >= up - 1e-12)
    # flat at both ends, and not symmetric about the middle
    assert abs(up[-1] - up[-100]) < 1e-4
    middle = 0.5 * (top + bottom)
    assert np.max(np.abs((up - middle) + (down[::-1] - middle))) > 0.1


@seeds
def test_noise_does_not_switch_envelopes(seed: int) -> None:
    """A tiny wiggle on the way up changes the output by no more than the wiggle does."""
    rng = np.random.default_rng(seed)
    x = np.linspace(-2.0, 2.0, 400)
    noisy = x + 1e-9 * rng.standard_normal(x.size)
    y, _ = UNEQUAL.run(x, UNEQUAL.initial_memory(-2.0))
    z, _ = UNEQUAL.run(noisy, UNEQUAL.initial_memory(-2.0))
    assert np.max(np.abs(y - z)) < 1e-7


@seeds
def test_rate_independence_wiping_out_congruency(seed: int) -> None:
    rng = np.random.default_rng(seed)
    memory = UNEQUAL.run(rng.uniform(-4, 4, 20))[1]
    low, high = np.sort(rng.uniform(-3, 3, 2))
    _, once = UNEQUAL.run([low, high], memory)
    _, dense = UNEQUAL.run([*np.linspace(low, high, 500)], memory)
    _, detour = UNEQUAL.run([low, high, *rng.uniform(low, high, 9), high], memory)
    np.testing.assert_allclose(dense, once, atol=1e-15)
    np.testing.assert_allclose(detour, once, atol=1e-15)
    way = np.concatenate((np.linspace(low, high, 20), np.linspace(high, low, 20)))
    loops = []
    for _ in range(2):
        past = UNEQUAL.run(rng.uniform(-5, 5, 20))[1]
        y, _ = UNEQUAL.run(way, UNEQUAL.run([low, high, low], past)[1])
        loops.append(y - y[0])
    np.testing.assert_allclose(loops[1], loops[0], atol=1e-13)


@SHAPES
@seeds
def test_exact_inverse_from_a_memory_with_a_past(shape: Any, seed: int) -> None:
    operator = same(shape)
    rng = np.random.default_rng(seed)
    memory = operator.run(rng.uniform(-4, 4, 20))[1]
    x = rng.uniform(-4, 4, 200)
    y, after = operator.run(x, memory)
    inverse = operator.inverse()
    back, after_back = inverse.run(y, operator.inverse_memory(memory))
    assert np.max(np.abs(back - x)) < 1e-12
    np.testing.assert_allclose(after_back, operator.inverse_memory(after), atol=1e-12)
    again: Any = inverse.inverse()
    np.testing.assert_allclose(again.weights, operator.weights, rtol=1e-12)
    np.testing.assert_allclose(inverse.inverse_memory(after_back), after, atol=1e-12)


@seeds
def test_numeric_inverse_of_unequal_envelopes(seed: int) -> None:
    memory = found_back(UNEQUAL, seed, (-2.0, 2.0), 100, near=1e-10)
    with pytest.raises(NotInvertible, match="use numeric_inverse"):
        UNEQUAL.inverse()
    with pytest.raises(NotInvertible, match="use numeric_inverse"):
        UNEQUAL.inverse_memory(memory)


def test_slopes_that_are_not_positive_have_no_inverse() -> None:
    bad = GeneralisedPrandtlIshlinskii(THRESHOLDS, (1.0, -1.5, 1.0), MIXED, MIXED)
    with pytest.raises(NotInvertible, match=r"weights\[1\]"):
        bad.inverse()


def test_beyond_saturation_there_is_no_input() -> None:
    operator = same(TANGENT)
    inverse = operator.inverse()
    y, _ = operator.run([0.0, 60.0])
    with pytest.raises(NotInvertible, match=r"no input gives y\[1\]") as caught:
        inverse.run([0.0, float(y[1]) + 0.1])
    assert caught.value.index == 1
    with pytest.raises(NotInvertible, match="no input reaches"):
        numeric_inverse(UNEQUAL, [0.0, 99.0])


@pytest.mark.parametrize("ratio", 10.0 ** np.arange(-9, 10, 3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_inverse_envelope_for_all_ratios(ratio: float, sign: float) -> None:
    shape = (sign * 2.0, sign * 0.7, 0.0, 2.0 * 0.7 * ratio, 0.0)
    u = np.concatenate((np.logspace(-8, 0.3, 200), np.linspace(2, 60, 400)))
    x = np.concatenate((-u, u)) / 0.7
    y = np.asarray(envelope(NUMPY, x, shape))
    back = np.asarray(inverse_envelope(NUMPY, y, shape))
    # what the rounding of y costs at the slope there, and of x itself
    slope = 1.4 * (1 - np.tanh(0.7 * x) ** 2) + shape[3]
    allowed = 1e-13 * np.abs(x) + 1e-15 * (np.abs(y) + 1e-300) / slope
    assert np.all(np.abs(back - x) <= allowed)


def test_inverse_envelope_with_symbols() -> None:
    y = ca.SX.sym("y")
    for shape in (MIXED, TANGENT, STRAIGHT):
        f = ca.Function("f", [y], [inverse_envelope(CASADI, y, shape)])
        for at in (-1.0, 0.0, 0.4):
            expected = float(inverse_envelope(NUMPY, at, shape))
            assert float(f(at)) == pytest.approx(expected, rel=1e-13, abs=1e-14)
    with pytest.raises(BadParameter, match="no closed form"):
        inverse_envelope(SYMPY, 0.5, MIXED)


def test_envelope_numbers() -> None:
    assert envelope_range(MIXED) == (-np.inf, np.inf)
    assert envelope_range(TANGENT) == (-4.2, 3.8)
    h = 1e-6
    for shape in (MIXED, TANGENT, FALLING, STRAIGHT):
        rise = envelope(NUMPY, 0.4 + h, shape) - envelope(NUMPY, 0.4 - h, shape)
        assert envelope_slope(shape, 0.4) == pytest.approx(float(rise) / (2 * h), rel=1e-8)


def test_largest_excess() -> None:
    x = np.linspace(-80, 80, 2_000_001)
    for left, right in ((LEFT, RIGHT), (RIGHT, LEFT), (MIXED, (1.0, 2.0, -3.0, 0.5, 0.0))):
        dense = float(np.max(envelope(NUMPY, x, left) - envelope(NUMPY, x, right)))
        assert largest_excess(left, right) == pytest.approx(dense, abs=1e-7)
        assert largest_excess(left, right) >= dense - 1e-12
    assert largest_excess(MIXED, STRAIGHT) == np.inf


def test_initial_memory_is_reachable() -> None:
    states = UNEQUAL.initial_memory(0.5, (50.0, -50.0))
    assert states[0] - states[1] == pytest.approx(0.7)
    assert UNEQUAL.initial_memory(0.5, states) == states


@pytest.mark.parametrize(
    ("left", "right", "message"),
    [
        ((1.0, 2.0, 0.0, 0.0), MIXED, "left has 4 entries"),
        ((1.0, -2.0, 0.0, 1.0, 0.0), MIXED, "does not rise strictly"),
        (MIXED, (0.0, 1.0, 0.0, 0.0, 0.0), "right = .* does not rise strictly"),
        ((1.0, 0.0, 0.0, 1.0, 0.0), MIXED, r"left\[1\] = 0"),
        (MIXED, STRAIGHT, "left exceeds right by inf"),
        ((1.0, 1.0, 0.0, 0.0, 0.7), (1.0, 1.0, 0.0, 0.0, 0.0), "left exceeds right by 0.7"),
    ],
)
def test_errors(left: Any, right: Any, message: str) -> None:
    with pytest.raises(BadParameter, match=message):
        GeneralisedPrandtlIshlinskii(THRESHOLDS, WEIGHTS, left, right)


def test_more_errors() -> None:
    with pytest.raises(BadParameter, match=r"thresholds\[0\]"):
        GeneralisedPrandtlIshlinskii((0.1, 0.3), (1.0, 1.0), MIXED, MIXED)
    symbol = ca.SX.sym("a")
    assert check_envelope("left", (symbol, 1.0, 0.0, 0.0, 0.0))[0] is symbol
