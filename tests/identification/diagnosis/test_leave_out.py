"""Every stretch held out once: the identity against refits, and the order of the rows."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bondgraph.signals.split import interleaved
from bondgraph.support.arrays import Array
from identification.diagnosis.evidence.leave_out import (
    BLOCKS,
    HEAVY,
    LeftOut,
    Rows,
    left_out,
    rows_of,
    stretch_sums,
    stretched,
)
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import evaluate
from tests.identification.diagnosis.effect_plants import PLANTS, scene


def one_channel(count: int, blocks: int) -> Rows:
    order = np.arange(count) * blocks // count
    return Rows(np.arange(count), np.zeros(count, int), order)


def refitted(x: Array, y: Array, precision: Array, left: Array) -> Array:
    """Residual y - x w of the rows `left` for the weights that all other rows give."""
    a = x[~left].T @ x[~left] + np.diag(precision)
    return np.asarray(y[left] - x[left] @ np.linalg.solve(a, x[~left].T @ y[~left]))


def fitted(x: Array, y: Array, precision: Array, rows: Rows) -> LeftOut:
    a = x.T @ x + np.diag(precision)
    return stretched(x, rows).held_out(y - x @ np.linalg.solve(a, x.T @ y), precision)


@pytest.mark.parametrize("strength", [0.0, 7.0, 300.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_identity_is_what_refits_give(seed: int, strength: float) -> None:
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((400, 6)) * np.array([1.0, 1e-5, 1e4, 1.0, 3.0, 1.0])
    x[:, 3] += 0.9 * x[:, 0]
    y = rng.standard_normal(400)
    precision = strength * np.array([1.0, 0.0, 1.0, 2.0, 0.0, 0.5])
    rows = one_channel(400, 10)
    out = fitted(x, y, precision, rows)
    assert out.leverage.max() < HEAVY
    for b in range(rows.blocks):
        left = rows.block == b
        assert out.residual[left] == pytest.approx(refitted(x, y, precision, left), abs=1e-9)


def test_stretches_of_several_windows_and_channels_leave_together() -> None:
    rng = np.random.default_rng(3)
    x, y = rng.standard_normal((600, 4)), rng.standard_normal(600)
    # two channels in two windows: rows of one stretch stand in two places
    sample = np.concatenate([np.tile(np.arange(150), 2), np.tile(np.arange(150, 300), 2)])
    channel = np.tile(np.repeat([0, 1], 150), 2)
    rows = Rows(sample, channel, sample * 7 // 300)
    out = fitted(x, y, np.zeros(4), rows)
    for b in range(7):
        left = rows.block == b
        assert out.residual[left] == pytest.approx(refitted(x, y, np.zeros(4), left), abs=1e-9)
    sums = stretch_sums(rows, y, 2)
    assert sums.shape == (7, 2)
    assert sums[3, 1] == pytest.approx(y[(rows.block == 3) & (channel == 1)].sum())


def test_a_stretch_that_decides_alone_is_bounded() -> None:
    rng = np.random.default_rng(4)
    y = rng.standard_normal(400)
    x = np.stack([np.ones(400), np.zeros(400)], axis=1)
    x[40:80, 1] = rng.standard_normal(40)  # moves in the second stretch alone
    rows = one_channel(400, 10)
    out = fitted(x, y, np.zeros(2), rows)
    assert out.leverage[1] == pytest.approx(1.0)
    assert out.leverage[[0, *range(2, 10)]].max() < 0.2
    assert np.isfinite(out.residual).all()
    grown = np.linalg.norm(out.residual) / np.linalg.norm(out.fitted)
    assert grown < 1.0 / (1.0 - HEAVY)


def test_columns_that_do_nothing_change_nothing() -> None:
    rng = np.random.default_rng(5)
    x, y = rng.standard_normal((200, 3)), rng.standard_normal(200)
    rows = one_channel(200, 8)
    plain = fitted(x, y, np.zeros(3), rows)
    idle = np.hstack([x, np.zeros((200, 1)), x[:, :1]])  # nothing, and a copy
    again = stretched(idle, rows).held_out(plain.fitted, np.zeros(5))
    assert again.residual == pytest.approx(plain.residual, abs=1e-8)


@cache
def small() -> Fit:
    s = scene("mechanical")
    y = s.data.readings + s.data.floor * np.random.default_rng(6).standard_normal((s.data.n, 2))
    split = interleaved(0, s.data.n)
    data = Data("run", s.data.time, s.data.commands, y, s.data.names, s.data.floor, split)
    return fit(Problem(PLANTS["mechanical"].build(), data), max_iterations=10)


@pytest.mark.parametrize("window", [None, 100])
def test_rows_stand_in_the_order_of_the_residual(window: int | None) -> None:
    made = small()
    problem = made.problem
    if window is not None:
        made = fit(replace(problem, window=window), max_iterations=4)
        problem = made.problem
    rows = rows_of(problem)
    e = evaluate(problem, made.point)
    data = problem.data
    left = ((data.readings - e.y) / data.floor)[rows.sample, rows.channel]
    same = np.allclose(e.residual, left, atol=1e-9 * np.abs(left).max())
    turned = np.allclose(e.residual, -left, atol=1e-9 * np.abs(left).max())
    assert same or turned
    assert np.ptp(left) > 1.0  # else any order would do
    train = np.flatnonzero(data.mask("train"))
    assert sorted(set(rows.sample)) == train.tolist()
    assert rows.blocks == BLOCKS
    assert (np.diff(rows.block[rows.channel == 0]) >= 0).all()
    for b in range(rows.blocks):
        assert np.ptp(rows.sample[rows.block == b]) < data.n / 20


def test_a_good_fit_predicts_what_it_has_not_seen() -> None:
    out = left_out(small())
    rms = np.sqrt(np.mean(out.residual**2))
    assert 1.0 <= rms / np.sqrt(np.mean(out.fitted**2)) < 1.05
    assert rms == pytest.approx(1.0, abs=0.1)


def test_left_out_is_what_a_refit_without_the_stretch_predicts() -> None:
    made = small()
    out = left_out(made)
    b = int(np.argmax(out.leverage))
    gone = set(out.rows.sample[out.rows.block == b].tolist())
    train = np.array([i for i in np.flatnonzero(made.problem.data.mask("train")) if i not in gone])
    edges = np.flatnonzero(np.diff(train) > 1) + 1
    parts = tuple(slice(int(p[0]), int(p[-1]) + 1) for p in np.split(train, edges))
    data = replace(made.problem.data, split=replace(made.problem.data.split, train=parts))
    again = fit(replace(made.problem, data=data), start=made.point, max_iterations=15)
    rows = out.rows
    at = rows.block == b
    e = evaluate(made.problem, again.point, derivatives=False)
    moved = e.residual[at] - out.fitted[at]
    foretold = out.residual[at] - out.fitted[at]
    assert np.linalg.norm(foretold) > 0.01
    assert np.linalg.norm(moved - foretold) < 0.1 * np.linalg.norm(foretold)
