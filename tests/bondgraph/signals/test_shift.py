"""Fractional delays, constant or of every sample its own, and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.signals.fractional_delay import delayed, delayed_within, warped
from bondgraph.signals.varying_delay import warped_within

T = np.arange(400.0)
INSIDE = slice(20, -20)


def wave(t: np.ndarray) -> np.ndarray:
    """Return two tones, the faster with nine samples a period."""
    return np.stack([np.sin(0.11 * t + 0.3), np.cos(0.7 * t)], axis=1)


def slope(t: np.ndarray) -> np.ndarray:
    return np.stack([0.11 * np.cos(0.11 * t + 0.3), -0.7 * np.sin(0.7 * t)], axis=1)


@pytest.mark.parametrize("lag", [0.0, 0.3, 0.999, 1.0, 2.5, -0.4, -3.2])
def test_constant_delay_and_its_derivative(lag: float) -> None:
    value, change = delayed(wave(T), lag)
    assert np.abs(value - wave(T - lag))[INSIDE].max() < 2e-4
    assert np.abs(change + slope(T - lag))[INSIDE].max() < 2e-3


@pytest.mark.parametrize("rate", [0.0, 5e-5, -5e-5, 3e-3, -0.01])
def test_warping_reads_the_signal_where_the_other_clock_is(rate: float) -> None:
    late = 0.2 - rate * T
    value, change = warped(wave(T), late)
    inside = INSIDE if rate > -0.005 else slice(20, -20)
    assert np.abs(value - wave(T - late))[inside].max() < 2e-4
    assert np.abs(change + slope(T - late))[inside].max() < 2e-3


def test_warping_by_a_constant_is_the_delay() -> None:
    for lag in (0.0, 0.37, 1.0, -2.6):
        value, change = warped(wave(T), np.full(T.size, lag))
        plain, by_lag = delayed(wave(T), lag)
        assert np.allclose(value, plain, atol=1e-13)
        assert np.allclose(change, by_lag, atol=1e-13)


def test_derivative_of_the_warping_is_that_of_its_value() -> None:
    """Of the interpolation itself, not only of the signal: fits need it exactly."""
    late = 0.35 + 0.2 * np.sin(0.01 * T)
    h = 1e-6
    y = np.random.default_rng(0).standard_normal((T.size, 2))
    numeric = (warped(y, late + h)[0] - warped(y, late - h)[0]) / (2 * h)
    assert np.abs(warped(y, late)[1] - numeric).max() < 1e-7


def test_no_delay_changes_no_bit() -> None:
    y = np.random.default_rng(1).standard_normal((50, 3))
    assert np.array_equal(warped(y, np.zeros(50))[0], y)
    assert np.array_equal(delayed(y, 0.0)[0], y)


@pytest.mark.parametrize("late", [1e3, -1e3])
def test_beyond_its_ends_the_signal_rests(late: float) -> None:
    y = np.arange(30.0)[:, None] + 5.0
    end = y[0] if late > 0 else y[-1]
    for value, change in (warped(y, np.full(30, late)), delayed(y, late)):
        assert np.allclose(value, end)
        assert np.allclose(change, 0.0, atol=1e-9)


def test_short_signals() -> None:
    for n in (1, 2, 3, 7):
        y = np.ones((n, 1))
        assert np.allclose(warped(y, np.full(n, 0.4))[0], 1.0)
        assert np.allclose(delayed(y, 0.4)[0], 1.0)


def test_delay_between_points_within_a_sample_keeps_kinks() -> None:
    """A triangle that bends at the samples only, known at four points a sample."""
    m, n = 4, 40
    fine = np.abs(np.arange((n - 1) * m + 1) / m % 8 - 4.0)
    for lag in (0.25, 1.6, 3.0):
        value, change = delayed_within(fine, lag, m)
        at = np.arange(n) - lag
        expected = np.abs(at % 8 - 4.0)
        assert np.allclose(value[4:], expected[4:], atol=1e-12)
        if lag % 1:
            assert np.allclose(np.abs(change[4:]), 1.0, atol=1e-9)


@pytest.mark.parametrize("m", [1, 2, 3, 4, 8, 16, 64])
def test_delay_between_many_points_within_a_sample_amplifies_nothing(m: int) -> None:
    """A polynomial through all points of an interval multiplies a kink's error by 2**m."""
    points = np.arange(40 * m + 1) / m
    kinked = np.abs(points - 20.37)
    for lag in (0.03, 0.4, 0.97, 2.61):
        value, change = delayed_within(kinked, lag, m)
        wanted = np.abs(np.arange(41) - lag - 20.37)
        assert np.abs(value - wanted)[4:].max() < 0.5 / m
        assert np.abs(change).max() < 3.0
        varying, _ = warped_within(kinked, np.full(41, lag), m)
        assert np.allclose(varying[4:], value[4:], rtol=0, atol=1e-12)


@pytest.mark.parametrize("m", [4, 16, 64])
def test_derivative_by_a_delay_between_points_is_that_of_the_value(m: int) -> None:
    smooth = np.sin(0.4 * np.arange(30 * m + 1) / m)
    for lag in (0.212, 0.753, 1.391):
        _, change = delayed_within(smooth, lag, m)
        ahead, behind = (delayed_within(smooth, lag + h, m)[0] for h in (1e-5, -1e-5))
        assert np.allclose(change, (ahead - behind) / 2e-5, rtol=0, atol=1e-8)
