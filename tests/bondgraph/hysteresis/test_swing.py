"""The turning-point method and the compiled bank against the plain clamps, from any memory."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import MaxwellResistiveCapacitor, PrandtlIshlinskii
from bondgraph.hysteresis.compiled import compiled_record
from bondgraph.hysteresis.plays import kernels as compiled_loops
from bondgraph.hysteresis.plays.play import play_record, weighted_plays
from bondgraph.hysteresis.plays.swing import SWING_FROM, extremes_of

seeds = st.integers(0, 2**32 - 1)
quick = settings(max_examples=40, deadline=None, derandomize=True, database=None)


def drawn(seed: int) -> tuple[Any, Any, Any, Any]:
    """Thresholds, weights of either sign, a past and a record of small and large swings."""
    rng = np.random.default_rng(seed)
    n = int(rng.choice([1, 2, 5, 12, 39]))  # every number of plays is a program of its own
    r = np.cumsum(rng.uniform(0.01, 1.0, n) * rng.choice([1e-3, 1.0], n))
    w = rng.normal(size=n + 1)
    past = np.cumsum(rng.normal(size=40)) * rng.choice([0.1, 1.0, 5.0])
    size = SWING_FROM + 500
    steps = rng.normal(size=size)
    steps[rng.uniform(size=size) < 0.2] = 0.0  # plateaus
    walk = np.cumsum(steps) * 0.3
    jumps = rng.normal(size=size) * rng.choice([0.1, 1.0, 10.0], size)
    return r, w, past, walk if seed % 2 else jumps


@quick
@given(seed=seeds)
def test_turning_points_equal_clamps(seed: int) -> None:
    r, w, past, x = drawn(seed)
    operator = PrandtlIshlinskii((0.0, *r), tuple(w))
    memory = operator.run(past)[1]
    fast, after = operator.run(x, memory)
    plain, expected = compiled_record(operator, x, memory, 0.0)
    size = np.abs(w).sum() * np.abs(x).max()
    assert np.abs(fast - plain).max() < 2e-14 * size
    assert after == expected


@quick
@given(seed=seeds)
def test_stops_by_turning_points(seed: int) -> None:
    r, w, past, x = drawn(seed)
    k = np.abs(w[1:]) + 0.1
    operator = MaxwellResistiveCapacitor(tuple(k), tuple(k * r))
    memory = operator.run(past)[1]
    fast, after = operator.run(x, memory)
    plain, expected = compiled_record(operator, x, memory, 0.0)
    assert np.abs(fast - plain).max() < 2e-14 * k.sum() * max(np.abs(x).max(), r[-1])
    np.testing.assert_allclose(after, expected, rtol=1e-14, atol=1e-14)


@quick
@given(seed=seeds)
def test_the_extremes_found_leave_the_states(seed: int) -> None:
    r, w, past, _ = drawn(seed)
    operator = PrandtlIshlinskii((0.0, *r), tuple(w))
    wanted = np.random.default_rng(seed).normal(size=r.size) * 3.0
    states = np.array(operator.initial_memory(float(past[-1]), tuple(wanted)))
    extremes, direction = extremes_of(r, states, float(past[-1]))
    assert np.all(np.sign(np.diff(extremes)) == -direction * (-1.0) ** np.arange(extremes.size - 1))
    # from the far side of the outermost extreme, the extremes alone make the states
    start = extremes[0] + direction * -10.0 * (r[-1] + 1.0)
    y = np.full(r.size, start)
    for extreme in (start, *extremes):
        y = np.maximum(extreme - r, np.minimum(extreme + r, y))
    np.testing.assert_allclose(y, states, rtol=1e-12, atol=1e-12)


def test_states_that_no_history_leaves_are_carried_by_the_clamps() -> None:
    x = 5.0 * np.sin(np.arange(SWING_FROM + 100) / 30.0)
    plays = PrandtlIshlinskii((0.0, 1.0, 3.0), (1.0, 1.0, 1.0))
    springs = MaxwellResistiveCapacitor((1.0, 1.0), (1.0, 3.0))
    for operator in (plays, springs):
        whole, after = operator.run(x, (0.9, -2.5))
        plain, expected = compiled_record(operator, x, (0.9, -2.5), 0.0)
        np.testing.assert_allclose(whole, plain, rtol=0, atol=1e-12)
        assert after == expected


@pytest.mark.parametrize("n", [1, 56, 57, 200])
def test_the_bank_pads_without_a_trace(n: int) -> None:
    rng = np.random.default_rng(n)
    r, w, x = np.sort(rng.uniform(0.1, 2.0, n)), rng.normal(size=n), rng.normal(size=1500)
    states = play_record(x, r, np.zeros(n))
    total, last = weighted_plays(x, r, w, np.zeros(n))
    np.testing.assert_allclose(total, states @ w, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(last, states[-1])


def test_without_a_compiler_the_same(monkeypatch: Any) -> None:
    r, w, past, x = drawn(3)
    operator = PrandtlIshlinskii((0.0, *r), tuple(w))
    k = np.abs(w[1:]) + 0.1
    springs = MaxwellResistiveCapacitor(tuple(k), tuple(k * r))
    memories = [o.run(past)[1] for o in (operator, springs)]
    native = [o.run(x, m) for o, m in zip((operator, springs), memories, strict=True)]
    columns = operator.regressors(x, memories[0])
    monkeypatch.setenv("BONDSIGHT_NO_COMPILER", "1")
    compiled_loops._library.cache_clear()
    try:
        assert not compiled_loops.kernels_available()
        for o, m, (y, after) in zip((operator, springs), memories, native, strict=True):
            again, left = o.run(x, m)
            np.testing.assert_allclose(again, y, rtol=0, atol=1e-12 * np.abs(y).max())
            np.testing.assert_allclose(left, after, rtol=1e-14, atol=1e-14)
        np.testing.assert_array_equal(operator.regressors(x, memories[0]), columns)
    finally:
        compiled_loops._library.cache_clear()
