"""Preisach operator: relays, Everett function, plays, energy, identification matrix, inverse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.hysteresis.preisach.preisach import Preisach
from bondgraph.hysteresis.preisach.preisach_grid import preisach_from_everett, preisach_from_relays
from bondgraph.support.ops import NUMPY
from tests.bondgraph.hysteresis.checked import energy_of_a_move, found_back

KNOTS = (-3.0, -0.4, 1.0, 2.5)
DENSITIES = (0.3, 0.7, 0.1, 0.6, 0.2, 0.4, 0.0, 0.9, 0.3)
OPERATOR = Preisach((0.0, 0.5, 1.3), KNOTS, DENSITIES, 0.8)
seeds = pytest.mark.parametrize("seed", range(8))


def relays(x: Any, up: Any, down: Any, weights: Any) -> Any:
    """Relays one by one, all down before the first sample; nothing shared with the package."""
    state = -np.ones(len(weights))
    output = []
    for value in x:
        state = np.where(value >= up, 1.0, np.where(value <= down, -1.0, state))
        output.append(float(weights @ state))
    return np.array(output)


def relay_grid(seed: int, m: int) -> tuple[Any, Any, Any, Any, Any]:
    """Levels, weights of the cells, and one relay in the middle of each cell."""
    rng = np.random.default_rng(seed)
    levels = np.linspace(-1.0, 2.0, m + 1)
    weights = np.triu(rng.uniform(0, 1, (m, m)))
    i, j = np.triu_indices(m)
    middle = 0.5 * (levels[:-1] + levels[1:])
    # on the diagonal the two switches share a cell: up just above down
    return levels, weights, middle[j] + 1e-3 * (i == j), middle[i], weights[i, j]


@seeds
def test_relays_on_the_grid(seed: int) -> None:
    levels, weights, up, down, flat = relay_grid(seed, 7)
    rng = np.random.default_rng(seed + 100)
    x = np.concatenate(([-9.0], rng.choice(levels, 200)))
    expected = relays(x, up, down, flat)
    y, _ = preisach_from_relays(levels, weights).run(x)
    np.testing.assert_allclose(y - y[0], expected - expected[0], atol=1e-12)


@seeds
def test_relays_between_levels_stay_within_the_stated_error(seed: int) -> None:
    """Off the grid the two differ by the relays that switch within a step, twice their weight."""
    levels, weights, up, down, flat = relay_grid(seed, 7)
    rng = np.random.default_rng(seed + 200)
    # turning points on levels, so that only the last, free move is off the grid
    history = np.concatenate(([-9.0], rng.choice(levels, 30)))
    operator = preisach_from_relays(levels, weights)
    base, memory = operator.run(history)
    last = float(rng.uniform(levels[0], levels[-1]))
    expected = relays([*history, last], up, down, flat)
    difference = float(operator.value(NUMPY, last, memory)) - base[0] - (expected[-1] - expected[0])
    step = int(np.searchsorted(levels, last)) - 1
    largest = max(weights[: step + 1, step].sum(), weights[step, step:].sum())
    assert abs(difference) <= 2.0 * largest + 1e-12
    assert abs(difference) > 1e-6  # it is an approximation there


@seeds
def test_everett_table_is_reproduced(seed: int) -> None:
    rng = np.random.default_rng(seed)
    levels = np.linspace(-2.0, 1.5, 9)
    table = np.triu(rng.normal(size=(9, 9)), 1)  # any table, even with negative densities
    operator = preisach_from_everett(levels, table)
    # by the formula, and as half of a measured first-order reversal
    for i, low in enumerate(levels):
        for j in range(i, 9):
            high = float(levels[j])
            assert float(operator.everett(float(low), high)) == pytest.approx(
                table[i, j], abs=1e-12
            )
            y, _ = operator.run([-30.0, high, float(low)])
            assert 0.5 * (y[1] - y[2]) == pytest.approx(table[i, j], abs=1e-12)


def test_density_of_relays_becomes_the_slope() -> None:
    """A uniform density mu of relays makes g' = 4 mu times the width of the band, here d/2."""
    levels = np.linspace(0.0, 1.0, 11)
    step, mu = 0.1, 3.0
    area = np.where(np.eye(10) > 0, 0.5, 1.0) * step**2  # a cell on the diagonal is half a square
    operator = preisach_from_relays(levels, mu * area)
    slopes = np.array(operator.densities).reshape(operator.shape)
    inside = slopes[slopes > 0.0]
    np.testing.assert_allclose(inside[20:], 4.0 * mu * 0.5 * step, rtol=1e-12)
    # the line of width 0 stands for half a band
    np.testing.assert_allclose(inside[:20], 4.0 * mu * 0.25 * step, rtol=1e-12)


def test_prandtl_ishlinskii_is_the_case_of_equal_slopes() -> None:
    plain = PrandtlIshlinskii((0.0, 0.5, 1.3), (0.8, 0.6, 0.4))
    operator = Preisach((0.0, 0.5, 1.3), (-50.0, 0.1, 50.0), (0, 0, 0.6, 0.6, 0.4, 0.4), 0.8)
    x = np.random.default_rng(0).uniform(-5, 5, 300)
    np.testing.assert_allclose(operator.run(x)[0], plain.run(x)[0], atol=1e-13)
    assert operator.run(x)[1] == plain.run(x)[1]
    assert float(operator.loop_loss(2.0)) == pytest.approx(float(plain.loop_loss(2.0)))


@seeds
def test_congruency(seed: int) -> None:
    rng = np.random.default_rng(seed)
    low, high = np.sort(rng.uniform(-3, 3, 2))
    way = np.concatenate((np.linspace(low, high, 20), np.linspace(high, low, 20)))
    loops = []
    for _ in range(3):
        memory = OPERATOR.run(rng.uniform(-5, 5, 20))[1]
        settled = OPERATOR.run([low, high, low], memory)[1]
        y, _ = OPERATOR.run(way, settled)
        loops.append(y - y[0])
    np.testing.assert_allclose(loops[1], loops[0], atol=1e-13)
    np.testing.assert_allclose(loops[2], loops[0], atol=1e-13)


@seeds
def test_energy_balance_on_a_monotone_move(seed: int) -> None:
    energy_of_a_move(OPERATOR, seed, 5.0, 200_001, 1e-7)


@pytest.mark.parametrize(("low", "high"), [(-2.0, 2.0), (-4.5, 0.7), (0.2, 1.1), (-9.0, 9.0)])
def test_loop_loss(low: float, high: float) -> None:
    memory = OPERATOR.run([low, high, low])[1]
    there = OPERATOR.advance(NUMPY, high, memory)
    ledger = OPERATOR.dissipated_energy(NUMPY, high, memory)
    ledger = ledger + OPERATOR.dissipated_energy(NUMPY, low, there)
    loss = float(OPERATOR.loop_loss(0.5 * (high - low), centre=0.5 * (high + low)))
    assert loss == pytest.approx(float(ledger), rel=1e-13)
    way = np.concatenate((np.linspace(low, high, 100_001), np.linspace(high, low, 100_001)))
    y, _ = OPERATOR.run(way, memory)
    area = float(np.sum(0.5 * (way[1:] + way[:-1]) * np.diff(y)))
    assert loss == pytest.approx(area, rel=1e-6)
    assert loss > 0.0 or high - low < 1.0


def test_a_negative_density_is_not_passive() -> None:
    operator = Preisach((0.0, 1.0), (-1.0, 0.0, 1.0), (0.0, 0.0, -0.1, 0.5), 1.0)
    assert OPERATOR.passive_port == "input"
    assert operator.passive_port is None
    with pytest.raises(BadParameter, match="no energy function"):
        operator.stored_energy(NUMPY, 1.0, operator.initial_memory())


@seeds
def test_regressors_times_parameters(seed: int) -> None:
    rng = np.random.default_rng(seed)
    memory = OPERATOR.run(rng.uniform(-5, 5, 20))[1]
    x = rng.uniform(-5, 5, 100)
    columns = OPERATOR.regressors(x, memory)
    assert columns.shape == (100, 10)
    parameters = np.array((OPERATOR.slope, *OPERATOR.densities))
    np.testing.assert_allclose(columns @ parameters, OPERATOR.run(x, memory)[0], atol=1e-13)


def test_saturation() -> None:
    low, high = OPERATOR.saturating_inputs
    assert (low, high) == (-4.3, 3.8)
    below, above = OPERATOR.saturation()
    y, _ = OPERATOR.run([high, high + 7.0, low, low - 5.0])
    np.testing.assert_allclose(
        y - 0.8 * np.array([high, high + 7, low, low - 5]), [above] * 2 + [below] * 2
    )
    assert below < 0.0 < above


@seeds
def test_numeric_inverse_from_a_memory_with_a_past(seed: int) -> None:
    found_back(OPERATOR, seed, (-5.0, 5.0), 100, near=1e-10)


def test_initial_memory_is_reachable() -> None:
    wild = OPERATOR.initial_memory(1.0, (40.0, -40.0))
    assert wild == pytest.approx((1.5, 0.7))
    assert OPERATOR.initial_memory(1.0, wild) == wild


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((0.1,), (0.0, 1.0), (1.0,)), r"thresholds\[0\] = 0.1 must be 0"),
        (((0.0, 1.0, 1.0), (0.0, 1.0), (1.0,) * 3), r"thresholds\[2\]"),
        (((0.0,), (0.0,), ()), "a cell needs two"),
        (((0.0,), (1.0, 0.0), (1.0,)), r"knots\[1\]"),
        (((0.0, 1.0), (0.0, 1.0), (1.0,)), "need 2, line by line"),
        (((0.0,), (0.0, 1.0), (float("nan"),)), r"densities\[0\]"),
    ],
)
def test_errors(arguments: Any, message: str) -> None:
    with pytest.raises(BadParameter, match=message):
        Preisach(*arguments)


def test_errors_of_the_grid() -> None:
    with pytest.raises(BadParameter, match=r"levels\[1\] = 0.4 is off"):
        preisach_from_everett([0.0, 0.4, 1.0], np.zeros((3, 3)))
    with pytest.raises(BadParameter, match=r"need \(3, 3\)"):
        preisach_from_everett([0.0, 0.5, 1.0], np.zeros((2, 3)))
    with pytest.raises(BadParameter, match=r"weights\[0, 1\] = nan"):
        preisach_from_relays([0.0, 0.5, 1.0], [[0.0, np.nan], [0.0, 0.0]])
    with pytest.raises(BadParameter, match="at least two"):
        preisach_from_relays([0.0], np.zeros((0, 0)))
