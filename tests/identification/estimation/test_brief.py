"""The beginning of a long record as a problem of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph.signals.split import interleaved
from identification.estimation.brief import BRIEF, brief, carried
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import Point, evaluate, offset_scale, start_point
from tests.settled import simulate
from tests.spring import spring

DT, NOISE = 0.01, 1e-4


def record(n: int) -> Problem:
    """Twice as much force in the second half: the spread of the reading is another one."""
    rng = np.random.default_rng(3)
    t = np.asarray(DT * np.arange(n), np.float64)
    u = np.repeat(rng.uniform(-1, 1, n // 10 + 1), 10)[:n] * np.where(t < t[n // 2], 1.0, 2.0)
    y = np.asarray(simulate(spring(), t, {"F": u})["x"]) + 0.003 + NOISE * rng.standard_normal(n)
    data = Data("run", t, {"F": u}, y[:, None], ("x",), np.array([NOISE]), interleaved(0, n))
    return Problem(spring(), data)


def test_a_short_record_has_no_beginning() -> None:
    assert brief(record(2 * BRIEF - 1)) is None
    long = record(2 * BRIEF)
    assert brief(replace(long, window=100)) is None
    assert brief(long) is not None


def test_the_parts_stay_what_they_are() -> None:
    long = record(2 * BRIEF)
    shorter = brief(long)
    assert shorter is not None
    for part in ("train", "test"):
        assert np.array_equal(shorter.data.mask(part), long.data.mask(part)[:BRIEF])
    assert np.array_equal(shorter.data.readings, long.data.readings[:BRIEF])


def test_unknowns_mean_the_same_in_both() -> None:
    long = record(2 * BRIEF)
    shorter = brief(long)
    assert shorter is not None
    assert float(offset_scale(long)[0]) > 1.2 * float(offset_scale(shorter)[0])
    made = fit(long, max_iterations=10)
    there = Point(carried(made.point.theta, long, shorter), made.point.states)
    y = evaluate(shorter, there, derivatives=False).y
    assert np.abs(y - made.simulated[:BRIEF]).max() < 1e-3 * NOISE
    back = carried(there.theta, shorter, long)
    assert back == pytest.approx(made.point.theta, rel=1e-12)
    known = replace(long, known_offsets=(0.4,))
    start = brief(known)
    assert start is not None
    assert start.known_offsets[0] * offset_scale(start) == pytest.approx(0.4 * offset_scale(known))


def test_an_empty_part_stays_empty() -> None:
    long = record(2 * BRIEF)
    n = long.data.n
    data = replace(long.data, split=replace(long.data.split, train=slice(0, n), test=slice(0, 0)))
    assert not data.begun(BRIEF).mask("test").any()
    assert brief(replace(long, data=data)) is None


def test_recordings_that_begin_later_take_their_states_with_them() -> None:
    long = record(2 * BRIEF)
    dynamics = long.dynamics
    known = {n: np.array([0.01, 0.02]) for n in dynamics.state_names}
    joined = replace(long, data=replace(long.data, breaks=(BRIEF + 100,)), known_states=known)
    shorter = brief(joined)
    assert shorter is not None
    assert start_point(joined).states == pytest.approx(np.array([[0.01] * 2, [0.02] * 2]))
    assert start_point(shorter).states == pytest.approx(np.array([[0.01] * 2]))
