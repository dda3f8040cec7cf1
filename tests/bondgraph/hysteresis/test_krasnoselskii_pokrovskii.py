"""Krasnoselskii-Pokrovskii operator against hysterons written out singly, and relays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.preisach.krasnoselskii_pokrovskii import KrasnoselskiiPokrovskii
from bondgraph.hysteresis.preisach.preisach_grid import preisach_from_relays
from tests.bondgraph.hysteresis.checked import energy_of_a_move, found_back

COUNT = 5
WEIGHTS = tuple(np.random.default_rng(9).uniform(0.1, 1.0, COUNT * (COUNT + 1) // 2))
OPERATOR = KrasnoselskiiPokrovskii(-2.0, 0.9, COUNT, 1.1, WEIGHTS)
seeds = pytest.mark.parametrize("seed", range(8))


def kernels(x: Any, operator: KrasnoselskiiPokrovskii) -> Any:
    """The published kernels, by direction of the input, from below all ramps; a column each."""

    def ridge(s: float) -> float:
        return float(np.clip(2.0 * s / operator.rise - 1.0, -1.0, 1.0))

    state = [-1.0] * len(operator.weights)
    rows, last = [], -np.inf
    for value in x:
        for k, (low, high) in enumerate(operator.centres):
            if value > last:
                state[k] = max(state[k], ridge(value - high))
            elif value < last:
                state[k] = min(state[k], ridge(value - low))
        rows.append(list(state))
        last = value
    return np.array(rows)


def record(seed: int, n: int = 200) -> Any:
    return np.concatenate(([-50.0], np.random.default_rng(seed).uniform(-3.5, 4.0, n)))


@seeds
def test_against_the_published_kernel(seed: int) -> None:
    x = record(seed)
    expected = kernels(x, OPERATOR)
    y, memory = OPERATOR.run(x)
    np.testing.assert_allclose(y, expected @ WEIGHTS, atol=1e-12)
    np.testing.assert_allclose(OPERATOR.regressors(x), expected, atol=1e-13)
    states = OPERATOR.hysterons(float(x[-1]), memory)
    np.testing.assert_allclose(states, expected[-1], atol=1e-13)


def test_becomes_relays_as_the_rise_vanishes() -> None:
    x = record(3, n=2000)
    low, high = np.array(OPERATOR.centres).T
    state, relays = -np.ones(len(WEIGHTS)), []
    for value in x:
        state = np.where(value >= high, 1.0, np.where(value <= low, -1.0, state))
        relays.append(float(state @ WEIGHTS))
    error = []
    for rise in (1e-1, 1e-2, 1e-3, 1e-9):
        steep = KrasnoselskiiPokrovskii(-2.0, 0.9, COUNT, rise, WEIGHTS)
        error.append(float(np.mean(np.abs(steep.run(x)[0] - relays))))
    # samples caught on a ramp are as rare as the ramp is narrow
    assert 3.0 < error[0] / error[1] < 30.0
    assert 2.0 < error[1] / error[2]
    assert error[3] < 1e-6  # rounding of a level, 2e-16, over the rise, times the weights


@seeds
def test_rise_of_a_spacing_is_a_grid_of_relays(seed: int) -> None:
    rng = np.random.default_rng(seed)
    flat = rng.uniform(0, 1, 10)
    operator = KrasnoselskiiPokrovskii.on_range(-1.0, 3.0, 4, tuple(flat))
    table = np.zeros((4, 4))
    for (low, high), w in zip(operator.centres, flat, strict=True):
        table[round(low) + 1, round(high) + 1] = w
    x = rng.uniform(-2, 4, 200)
    y, _ = operator.run(x)
    z, _ = preisach_from_relays([-1.0, 0.0, 1.0, 2.0, 3.0], table).run(x)
    np.testing.assert_allclose(y - y[0], z - z[0], atol=1e-13)


@seeds
def test_wiping_out_and_congruency(seed: int) -> None:
    rng = np.random.default_rng(seed)
    low, high = np.sort(rng.uniform(-3, 3, 2))
    way = np.concatenate((np.linspace(low, high, 20), np.linspace(high, low, 20)))
    loops = []
    for _ in range(3):
        memory = OPERATOR.run(rng.uniform(-5, 5, 20))[1]
        _, plain = OPERATOR.run([low, high], memory)
        _, detour = OPERATOR.run([low, high, *rng.uniform(low, high, 9), high], memory)
        assert plain == detour
        y, _ = OPERATOR.run(way, OPERATOR.run([low, high, low], memory)[1])
        loops.append(y - y[0])
    np.testing.assert_allclose(loops[1:], [loops[0]] * 2, atol=1e-13)


@seeds
def test_energy_balance_on_a_monotone_move(seed: int) -> None:
    energy_of_a_move(OPERATOR, seed, 4.0, 200_001, 1e-7)


def test_loop_loss() -> None:
    for low, high in ((-3.0, 4.0), (-1.0, 0.6)):
        memory = OPERATOR.run([low, high, low])[1]
        way = np.concatenate((np.linspace(low, high, 100_001), np.linspace(high, low, 100_001)))
        y, _ = OPERATOR.run(way, memory)
        area = float(np.sum(0.5 * (way[1:] + way[:-1]) * np.diff(y)))
        loss = float(OPERATOR.loop_loss(0.5 * (high - low), centre=0.5 * (low + high)))
        assert loss == pytest.approx(area, rel=1e-6)
        assert loss > 0.1


def test_saturates_at_the_sum_of_the_weights() -> None:
    y, _ = OPERATOR.run([-90.0, 90.0])
    np.testing.assert_allclose(y, [-sum(WEIGHTS), sum(WEIGHTS)], rtol=1e-13)
    np.testing.assert_allclose(OPERATOR.saturation(), y, rtol=1e-13)
    equal = KrasnoselskiiPokrovskii.on_range(0.0, 1.0, 6)
    np.testing.assert_allclose(equal.run([0.0, 1.0, 0.0])[0], [-1.0, 1.0, -1.0], atol=1e-12)


@seeds
def test_numeric_inverse_from_a_memory_with_a_past(seed: int) -> None:
    # the ridges of width 0 cover this range without a gap, so the output rises strictly
    found_back(OPERATOR, seed, (-1.9, 2.6), 100, near=1e-10)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"spacing": 0.0}, "spacing = 0.0 must be positive"),
        ({"rise": -1.0}, "rise = -1.0 must be positive"),
        ({"count": 0}, "count = 0 must be an integer"),
        ({"count": 3}, "3 levels have 6 pairs"),
    ],
)
def test_errors(change: Any, message: str) -> None:
    good = {"low": 0.0, "spacing": 1.0, "count": 2, "rise": 1.0, "weights": (1.0, 1.0, 1.0)}
    with pytest.raises(BadParameter, match=message):
        KrasnoselskiiPokrovskii(**{**good, **change})
