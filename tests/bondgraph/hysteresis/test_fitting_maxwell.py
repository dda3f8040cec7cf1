"""Stiffnesses of stops from records, and from the loading curve as the thesis does it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import BadInput, BadParameter, MaxwellResistiveCapacitor
from bondgraph.hysteresis.fitting import (
    elements_from_slopes,
    fit_loading_curve,
    fit_maxwell,
    loading_samples,
)

quick = settings(max_examples=20, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)
TABLE = MaxwellResistiveCapacitor.stack_2hz()
TABLE_K, TABLE_V, TABLE_Q = (
    np.array(values) for values in (TABLE.stiffnesses, TABLE.breakaways, TABLE.thresholds)
)


def loop(amplitude: float, periods: float = 2.25, samples: int = 4000) -> np.ndarray:
    """A sine that starts at rest."""
    return amplitude * np.sin(2.0 * np.pi * np.linspace(0.0, periods, samples))


def random_truth(rng: np.random.Generator) -> MaxwellResistiveCapacitor:
    """Slip points below 4."""
    n = int(rng.integers(1, 8))
    slips = np.cumsum(rng.uniform(0.1, 4.0 / n, n))
    k = rng.uniform(0.2, 3.0, n)
    return MaxwellResistiveCapacitor(tuple(k), tuple(k * slips))


@quick
@given(seed=seeds)
def test_stops_give_their_stiffnesses_back(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    truth = random_truth(rng)
    memory = truth.initial_memory(0.0, tuple(rng.uniform(-1, 1, truth.n_memory)))
    q = loop(5.0)
    v = truth.run(q, memory)[0] - 3.0
    fit = fit_maxwell(q, v, truth.thresholds, memory=memory, offset=True)
    np.testing.assert_allclose(fit.operator.stiffnesses, truth.stiffnesses, atol=1e-9)
    assert fit.offset == pytest.approx(-3.0, abs=1e-9)
    assert fit.unexcited == ()


def test_the_optimum_is_one() -> None:
    """Karush, Kuhn, Tucker on noisy data with too many slip points."""
    rng = np.random.default_rng(0)
    truth = MaxwellResistiveCapacitor((2.0, 1.0), (2.0, 3.0))
    q = loop(5.0)
    v = truth.run(q)[0] + rng.normal(0.0, 0.05, q.size)
    slips = np.linspace(0.25, 4.0, 16)
    fit = fit_maxwell(q, v, slips)
    stops = np.column_stack(
        [MaxwellResistiveCapacitor((1.0,), (r,)).run(q)[0] for r in slips.tolist()]
    )
    slope = stops.T @ (stops @ fit.weights - v) / (np.linalg.norm(stops, axis=0) * q.size)
    assert 0 < len(fit.active) < 16
    assert np.all(fit.weights >= 0.0)
    assert np.max(np.abs(slope[fit.weights > 0.0])) < 1e-12
    assert np.all(slope[list(fit.active)] > -1e-12)
    assert fit.operator.n_memory == 16 - len(fit.active) == len(fit.memory)
    modelled = fit.operator.run(q, fit.memory)[0]
    assert fit.rms == pytest.approx(np.sqrt(np.mean((modelled - v) ** 2)), rel=1e-9)


def test_elements_that_never_slip_are_one_spring() -> None:
    truth = MaxwellResistiveCapacitor((2.0, 1.0), (2.0, 6.0))
    q = loop(5.0)
    fit = fit_maxwell(q, truth.run(q)[0], (1.0, 6.0, 7.0))
    np.testing.assert_allclose(fit.weights, (2.0, 1.0, 0.0), atol=1e-12)
    found = {s.index: s for s in fit.unexcited}
    assert found[1].action == "kept"
    assert "linear spring" in found[1].reason
    assert found[2].action == "dropped"
    assert "element 1 (slip point 6)" in found[2].reason


def test_unknown_past() -> None:
    truth = MaxwellResistiveCapacitor((2.0, 1.0), (2.0, 3.0))
    q = loop(5.0)
    v, _ = truth.run(q, truth.initial_memory(0.0, (0.9, -1.0)))
    fit = fit_maxwell(q, v, (1.0, 2.0, 3.0, 9.0), memory="unknown")
    assert 0 < fit.start < q.size // 2
    np.testing.assert_allclose(fit.weights, (2.0, 0.0, 1.0, 0.0), atol=1e-11)
    assert "unknown past" in fit.unexcited[0].reason
    modelled = fit.operator.run(q[fit.start :], fit.memory)[0]
    np.testing.assert_allclose(modelled, v[fit.start :], atol=1e-11)


def test_table_6_4_from_its_loading_curve() -> None:
    """On the breakpoints of the table itself, from the rise and the loops that follow it."""
    q = loop(1.02 * TABLE_Q[-1], samples=20000)
    v, _ = TABLE.run(q)
    fit = fit_loading_curve(q, v, tuple(TABLE_Q))
    np.testing.assert_allclose(fit.operator.stiffnesses, TABLE_K, rtol=1e-9)
    np.testing.assert_allclose(fit.operator.breakaways, TABLE_V, rtol=1e-9)
    assert sum(fit.operator.breakaways) == pytest.approx(16.70, abs=0.005)
    printed = "1.9 5.9 14.3 23.6 33.6 44.2 55.4 66.6 78.1 89.9 102.8 113.1 126.5 138.8 147.9"
    assert 1e6 * fit.ends == pytest.approx([float(q) for q in printed.split()], abs=0.06)
    np.testing.assert_allclose(fit.slopes, np.cumsum(TABLE_K[::-1])[::-1], rtol=1e-9)


def test_the_printed_breakaways_would_saturate_too_low() -> None:
    """(5.11) and (5.13) as printed, f_i = k_i x_i with x_1 = 0, give 11.8 V instead of 16.7 V."""
    starts = np.append(0.0, TABLE_Q[:-1])
    slopes = np.cumsum(TABLE_K[::-1])[::-1]
    stiffnesses, breakaways = elements_from_slopes(tuple(slopes), tuple(TABLE_Q))
    assert float(np.sum(np.array(stiffnesses) * starts)) == pytest.approx(11.8, abs=0.05)
    assert sum(breakaways) == pytest.approx(16.7, abs=0.05)
    np.testing.assert_allclose(breakaways, TABLE_V, rtol=1e-9)
    # Nor is f_i the difference of the curve at the segment's ends, as the text has it.
    rises = slopes * np.diff(np.append(0.0, TABLE_Q))
    assert rises[:3] == pytest.approx((2.24, 1.67, 2.5), abs=0.1)
    assert breakaways[:3] == pytest.approx((1.42, 0.75, 1.16))


def test_equal_segments_follow_the_whole_loop() -> None:
    """From the rise alone; the first segment lumps the first two elements of the table."""
    q = loop(150e-6)
    v, _ = TABLE.run(q)
    fit = fit_loading_curve(q, v, 15)
    np.testing.assert_allclose(fit.ends, 150e-6 * np.arange(1, 16) / 15, rtol=1e-6)
    assert np.all(np.diff(fit.slopes) <= 0.0)
    again, _ = fit.operator.run(q, fit.memory)
    assert np.sqrt(np.mean((again - v) ** 2)) < 0.02 * np.ptp(v)


@quick
@given(seed=seeds)
def test_noise_bends_the_polygon_but_it_stays_concave(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    truth = random_truth(rng)
    q = 2.0 + loop(5.0, 0.25, 2000)
    v = truth.run(q, (2.0,) * truth.n_memory)[0] + 4.0 + rng.normal(0.0, 0.02, q.size)
    fit = fit_loading_curve(q, v, 8, offset=True)
    assert np.all(np.diff(fit.slopes) <= 1e-12)
    assert fit.slopes[-1] >= 0.0
    assert fit.offset == pytest.approx(4.0, abs=1.0)
    modelled = fit.operator.run(q, fit.memory)[0] + fit.offset
    assert fit.rms == pytest.approx(np.sqrt(np.mean((modelled - v) ** 2)), rel=1e-6)
    k, f = elements_from_slopes(tuple(fit.slopes), tuple(fit.ends))
    np.testing.assert_allclose(k, fit.solution.weights, atol=1e-12)
    np.testing.assert_allclose(f, fit.solution.weights * fit.ends, atol=1e-11)


def test_only_virgin_samples_are_used() -> None:
    """Loops after the rise may be anything; the falling side of a first fall counts as well."""
    q = np.array([0.0, 1.0, 2.0, 1.5, 2.0, 0.0, -1.0, -2.5, 3.0])
    assert loading_samples(q).tolist() == [True] * 3 + [False, True, False, False, True, True]
    falling = -np.linspace(0.0, 4.0, 41)
    fit = fit_loading_curve(falling, 2.0 * np.clip(falling, -1.0, 1.0) + falling, (1.0, 4.0))
    np.testing.assert_allclose(fit.slopes, (3.0, 1.0), atol=1e-12)


def test_segments_beyond_the_record_cannot_be_told_apart() -> None:
    q = np.linspace(0.0, 4.0, 41)
    fit = fit_loading_curve(q, 2.0 * np.minimum(q, 1.0) + q, (1.0, 5.0, 6.0))
    assert [s.index for s in fit.solution.unexcited] == [2]
    assert "segment 1 (1 to 5)" in fit.solution.unexcited[0].reason


LINE = [0.0, 1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("q", "v", "thresholds", "error", "words"),
    [
        ([0, np.nan, 1], [0, 1, 2], (1,), BadInput, r"q\[1\] = nan"),
        (LINE, [0, 1, np.inf, 3], (1,), BadInput, r"v\[2\] = inf"),
        (LINE, LINE[:2], (1,), BadInput, "q has 4 samples but v has 2"),
        ([1.0] * 4, LINE, (1,), BadInput, "q is constant"),
        (LINE, LINE, (0.0, 1.0), BadParameter, r"thresholds\[0\]"),
        (LINE, LINE, (2.0, 1.0), BadParameter, "not above"),
        (LINE, LINE[::-1], (1.0,), BadInput, "v falls where q rises"),
        (LINE, LINE, (1, 2, 3, 4, 5), BadInput, "4 samples cannot determine 5 weights"),
    ],
)
def test_bad_input_is_named(q: Any, v: Any, thresholds: Any, error: Any, words: Any) -> None:
    with pytest.raises(error, match=words):
        fit_maxwell(q, v, thresholds)


@pytest.mark.parametrize(
    ("v", "segments", "error", "words"),
    [
        (LINE, 0, BadParameter, "segments = 0"),
        (LINE, True, BadParameter, "segments = True"),
        (LINE, 2.5, BadParameter, "ends = 2.5 must be a sequence"),
        (LINE, (1.0, 1.0), BadParameter, "not above"),
        (LINE, (0.0, 1.0), BadParameter, r"ends\[0\]"),
        (LINE, 5, BadInput, "4 samples cannot determine 5"),
        (LINE[::-1], 2, BadInput, "v falls where q rises"),
        ([-9.0, -8.0, -7.0, -6.0], 2, BadInput, "no element gets a positive stiffness"),
    ],
)
def test_bad_loading_curves_are_named(v: Any, segments: Any, error: Any, words: Any) -> None:
    with pytest.raises(error, match=words):
        fit_loading_curve(LINE, v, segments)
