"""Play, stop and turning points."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import (
    PrandtlIshlinskii,
    play,
    play_record,
    reachable_plays,
    stop,
    turning_points,
)
from bondgraph.support.ops import NUMPY

quick = settings(max_examples=30, deadline=None, derandomize=True, database=None)
finite = st.floats(-10, 10)
records = st.lists(finite, min_size=1, max_size=80)


@quick
@given(x=records, width=st.floats(0, 5), y=finite)
def test_record_is_the_step_to_the_last_bit(x: Any, width: Any, y: Any) -> None:
    expected, state = [], y
    for value in x:
        state = float(play(NUMPY, value, width, state))
        expected.append(state)
    fast = play_record(np.array(x), np.array([width]), np.array([y]))
    assert fast.shape == (len(x), 1)
    assert fast[:, 0].tolist() == expected


@quick
@given(x=records)
def test_width_zero_is_the_identity(x: Any) -> None:
    assert play_record(np.array(x), np.zeros(1), np.ones(1))[:, 0].tolist() == x


@quick
@given(x=records, width=st.floats(0.01, 5))
def test_stop_is_the_clipped_increment(x: Any, width: Any) -> None:
    x = [0.0, *x]
    anchor = stretch = 0.0
    for before, now in pairwise(x):
        stretch = float(np.clip(stretch + now - before, -width, width))
        assert float(stop(NUMPY, now, width, anchor)) == pytest.approx(stretch, abs=1e-12)
        anchor = float(play(NUMPY, now, width, anchor))


def test_held_input_keeps_a_slipping_stop() -> None:
    anchor = float(play(NUMPY, 3.0, 1.0, 0.0))
    assert float(stop(NUMPY, 3.0, 1.0, anchor)) == 1.0


@quick
@given(x0=finite, y=st.lists(finite, min_size=3, max_size=3))
def test_reachable_states_are_nested(x0: Any, y: Any) -> None:
    r = (0.5, 2.0, 2.1)
    states = reachable_plays(NUMPY, x0, r, y)
    gaps = np.abs(np.diff([x0, *states]))
    assert np.all(gaps <= np.diff([0.0, *r]) + 1e-12)
    assert reachable_plays(NUMPY, x0, r, states) == pytest.approx(states, abs=1e-12)


def test_unreachable_states_are_why_the_inverse_needs_the_projection() -> None:
    """With states no history produces, the inverse recursion is wrong; projected it is exact."""
    operator = PrandtlIshlinskii((0.0, 1.0, 2.0), (1.0, 1.0, 1.0))
    wild = (1.0, -2.0)
    x = np.array([0.0, -0.5, 0.7, -3.0])

    def error(memory: Any) -> Any:
        z, _ = operator.run(x, memory)
        return np.abs(operator.inverse().run(z, operator.inverse_memory(memory))[0] - x).max()

    assert error(wild) > 0.1
    assert error(operator.initial_memory(0.0, wild)) < 1e-14


@quick
@given(x=records)
def test_turning_points_keep_every_extremum(x: Any) -> None:
    record = np.array(x)
    index = turning_points(record)
    assert index[0] == 0
    assert index[-1] == record.size - 1
    kept = np.interp(np.arange(record.size), index, record[index])
    between = np.diff(record)
    signs = np.sign(np.diff(kept))
    assert np.all((between == 0) | (np.sign(between) == signs))


def test_turning_points_of_a_constant() -> None:
    assert turning_points([1.0, 1.0, 1.0]).tolist() == [0, 2]
    assert turning_points([1.0]).tolist() == [0]
