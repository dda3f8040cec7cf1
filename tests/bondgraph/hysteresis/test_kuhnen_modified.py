"""The modified operator of Kuhnen: two-sided bends, saturation, conditions, congruency."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import Ang, BadParameter, NotInvertible
from bondgraph.hysteresis.plays.kuhnen_modified import bent_line, kuhnen_modified

quick = settings(max_examples=40, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)

# A stack of the usual size: +-100 V make about +-4 um, and both ends saturate, unequally.
THRESHOLDS = (0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0)
WEIGHTS = (21.2e-9, 5.1e-9, 4.3e-9, 3.9e-9, 3.1e-9, 2.6e-9, 1.9e-9)
CORNERS = (-2.6e-6, -1.8e-6, -0.9e-6, 0.8e-6, 1.6e-6, 2.4e-6)
SLOPES = (0.55, 0.8, 0.93, 1.0, 1.05, 0.85, 0.4)
STACK = kuhnen_modified(THRESHOLDS, WEIGHTS, CORNERS, SLOPES)


def wander(seed: int, size: float, n: int = 300) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.asarray(size * rng.uniform(-1, 1, n) * rng.choice([0.05, 0.3, 1.0], n))


def test_bent_line_has_the_slopes_between_its_corners() -> None:
    line = bent_line(CORNERS, SLOPES)
    edges = (-4e-6, *CORNERS, 4e-6)
    for low, high, slope in zip(edges[:-1], edges[1:], SLOPES, strict=True):
        y = line.run([low + 0.1 * (high - low), high - 0.1 * (high - low)])[0]
        assert (y[1] - y[0]) / (0.8 * (high - low)) == pytest.approx(slope, rel=1e-12)
    assert line.run([0.0])[0][0] == 0.0


@pytest.mark.parametrize(
    ("corners", "slopes"),
    [((), (2.0,)), ((1.0, 2.0), (1.0, 0.5, 0.2)), ((-2.0, -1.0), (0.3, 0.4, 1.0))],
)
def test_bends_may_lie_on_one_side_only(corners: Any, slopes: Any) -> None:
    line = bent_line(corners, slopes)
    y = np.linspace(-4, 4, 801)
    found = np.gradient(line.run(y)[0], y)
    expected = np.array(slopes)[np.searchsorted(corners, y)]
    smooth = np.min(np.abs(y[:, None] - np.array((*corners, 99.0))), axis=1) > 0.02
    np.testing.assert_allclose(found[smooth], expected[smooth], rtol=1e-9)
    np.testing.assert_allclose(line.inverse().run(line.run(y)[0])[0], y, atol=1e-12)


@quick
@given(seed=seeds)
def test_inverse_is_exact_on_both_sides(seed: Any) -> None:
    _, memory = STACK.run(wander(seed, 100.0))
    x = wander(seed + 1, 100.0)
    z, after = STACK.run(x, memory)
    back, after_back = STACK.inverse().run(z, STACK.inverse_memory(memory))
    assert np.max(np.abs(back - x)) < 1e-13 * np.ptp(x)
    np.testing.assert_allclose(after_back, STACK.inverse_memory(after), atol=1e-18)


def test_both_ends_saturate_differently() -> None:
    sweep = np.concatenate((np.linspace(0, 100, 300), np.linspace(100, -100, 600)[1:]))
    z, _ = STACK.run(sweep)
    inner, _ = STACK.play.run(sweep)
    assert z.max() < inner.max()
    assert z.min() > inner.min()
    assert not np.isclose(z.max(), -z.min(), rtol=0.02)
    full = float(np.sum(WEIGHTS))
    steepest = np.max(np.abs(np.diff(z) / np.diff(sweep)))
    assert steepest <= 1.05 * full * (1 + 1e-9)
    reached = STACK.dead_zone.inverse().run(z)[0]
    np.testing.assert_allclose(reached, inner, atol=1e-19)
    assert reached.max() > CORNERS[-1]  # so the last bends are really in use
    assert reached.min() < CORNERS[0]


def spread(operator: Any, low: float, high: float) -> float:
    """How much the shape of one minor loop depends on the history, over its height."""
    up = np.linspace(low, high, 41)
    shapes = []
    for history in ([100.0], [-100.0], [100.0, -100.0], [20.0], [-70.0, 100.0]):
        _, memory = operator.run([0.0, *history, low, high, low])
        y, _ = operator.run(np.concatenate((up, up[::-1], up)), memory)
        shapes.append(y - y[0])
    return float(np.max(np.ptp(shapes, axis=0)) / np.ptp(shapes))


@pytest.mark.parametrize(("low", "high", "least"), [(50.0, 70.0, 0.3), (-60.0, -30.0, 0.05)])
def test_loops_are_congruent_before_the_bends_and_not_after(
    low: float, high: float, least: float
) -> None:
    """Both loops cross a corner, at an input that depends on the history."""
    inner, outer = spread(STACK.play, low, high), spread(STACK, low, high)
    print(f"loop {low:.0f}..{high:.0f} V: spread of the plays {inner:.1e}, modified {outer:.2f}")
    assert inner < 1e-12
    assert outer > least
    assert STACK.play.congruent
    assert not STACK.congruent


def test_minor_loops_leave_no_trace() -> None:
    _, plain = STACK.run([0.0, 80.0, -30.0, 60.0])
    _, detour = STACK.run([0.0, 80.0, -30.0, 60.0, 10.0, 50.0, 20.0, 60.0])
    assert plain == detour


def test_symbols() -> None:
    w, s = ca.SX.sym("w", 2), ca.SX.sym("s", 3)
    operator = kuhnen_modified((0.0, 1.0), ca.vertsplit(w), (-1.0, 2.0), ca.vertsplit(s))
    assert isinstance(operator, Ang)
    from bondgraph.support.ops import CASADI

    x = ca.SX.sym("x")
    z = operator.value(CASADI, x, (0.0,))
    f = ca.Function("f", [x, w, s], [z, operator.inverse().value(CASADI, z, (0.0,))])
    for at in (-5.0, 0.5, 4.0):
        value, back = f(at, [1.0, 0.5], [0.5, 1.0, 0.25])
        numbers = kuhnen_modified((0.0, 1.0), (1.0, 0.5), (-1.0, 2.0), (0.5, 1.0, 0.25))
        assert float(value) == pytest.approx(numbers.run([at], (0.0,))[0][0], rel=1e-14)
        assert float(back) == pytest.approx(at, rel=1e-14)


def test_errors_name_the_offender() -> None:
    with pytest.raises(NotInvertible, match=r"slopes\[2\] = 0 is not positive") as caught:
        kuhnen_modified((0, 1), (1, 1), (-1, 1), (1, 1, 0))
    assert caught.value.index == 2
    with pytest.raises(NotInvertible, match=r"slopes\[0\] = -0\.1"):
        kuhnen_modified((0, 1), (1, 1), (-1, 1), (-0.1, 1, 1))
    with pytest.raises(NotInvertible, match=r"weights\[1\] = -1") as caught:
        kuhnen_modified((0, 1), (1, -1), (-1, 1), (1, 1, 1))
    assert caught.value.index == 1
    with pytest.raises(BadParameter, match="slopes has 2 entries but 2 corners"):
        bent_line((-1, 1), (1, 1))
    with pytest.raises(BadParameter, match=r"corners\[1\] = 0\.0"):
        bent_line((-1, 0, 1), (1, 1, 1, 1))
    with pytest.raises(BadParameter, match=r"corners\[1\] = -3\.0 is not above"):
        bent_line((-1, -3), (1, 1, 1))
    with pytest.raises(BadParameter, match=r"corners\[0\] = c must be a number"):
        bent_line((ca.SX.sym("c"),), (1, 1))
