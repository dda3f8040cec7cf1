"""Optimal shares of effort against designs known in closed form and a general optimiser."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.experiments.design import optimal_weights

POINTS = np.linspace(-1, 1, 41)
ENDS = [0, 20, 40]


def polynomial(order: int, first: tuple[int, ...] = ()) -> Array:
    powers = [*first, *(k for k in range(order + 1) if k not in first)]
    rows = POINTS[:, None] ** np.array(powers)
    return np.asarray(np.einsum("ki,kj->kij", rows, rows))[None]


def test_quadratic_regression() -> None:
    # Fedorov, Theory of Optimal Experiments (1972)
    d = optimal_weights(polynomial(2), 3, tolerance=1e-5)
    assert d.shares[ENDS] == pytest.approx(np.full(3, 1 / 3), abs=1e-3)
    a = optimal_weights(polynomial(2), 3, criterion="A", tolerance=1e-5)
    assert a.shares[ENDS] == pytest.approx([0.25, 0.5, 0.25], abs=2e-3)
    last = optimal_weights(polynomial(2, first=(2,)), 1, tolerance=1e-5)
    assert last.shares[ENDS] == pytest.approx([0.25, 0.5, 0.25], abs=2e-3)
    for w in (d, a, last):
        assert w.dispersion.max() <= w.chosen * (1 + 1e-5)
        assert w.efficiency > 1 - 2e-5
        assert w.shares.sum() == pytest.approx(1.0)


@pytest.mark.long
def test_cost_is_a_change_of_units() -> None:
    cost = 1 + POINTS**2
    w = optimal_weights(polynomial(1), 2, cost=cost, tolerance=1e-6)
    assert w.shares @ cost == pytest.approx(1.0)
    plain = optimal_weights(polynomial(1) / cost[None, :, None, None], 2, tolerance=1e-6)
    assert w.shares * cost == pytest.approx(plain.shares, abs=1e-2)
    assert w.of_even < 1.0


@pytest.mark.parametrize("criterion", ["D", "A"])
def test_as_good_as_a_general_optimiser(criterion: str) -> None:
    rng = np.random.default_rng(4)
    rows = rng.standard_normal((3, 12, 2, 4))
    each = np.einsum("skai,skaj->skij", rows, rows)

    def value(w: Array) -> float:
        total = np.einsum("k,skij->sij", w, each)
        if criterion == "A":
            return float(np.mean([np.trace(np.linalg.inv(m)[:2, :2]) for m in total]))
        return -float(
            np.mean([np.linalg.slogdet(m)[1] - np.linalg.slogdet(m[2:, 2:])[1] for m in total])
        )

    found = optimal_weights(each, 2, criterion=criterion, tolerance=1e-4)
    other = minimize(
        value, np.full(12, 1 / 12), bounds=[(0, 1)] * 12, method="SLSQP",
        constraints={"type": "eq", "fun": lambda w: w.sum() - 1}, options={"ftol": 1e-12},
    )  # fmt: skip
    assert value(found.shares) <= other.fun + 2e-4 * abs(other.fun)
    assert value(found.shares) >= other.fun - 2e-4 * abs(other.fun)
    assert found.efficiency > 0.999
    even = value(np.full(12, 1 / 12))
    expected = np.exp((-even + value(found.shares)) / 2) if criterion == "D" else other.fun / even
    assert found.of_even == pytest.approx(expected, rel=1e-3)


def test_an_early_stop_says_what_is_lost() -> None:
    rough = optimal_weights(polynomial(3), 4, largest=3)
    best = optimal_weights(polynomial(3), 4, tolerance=1e-5)

    def det(w: Array) -> float:
        return float(np.linalg.det(np.einsum("k,kij->ij", w, polynomial(3)[0])))

    actual = (det(rough.shares) / det(best.shares)) ** 0.25
    assert rough.efficiency <= actual < 1.0
    assert "at least" in repr(rough)


def test_what_is_not_determined() -> None:
    with pytest.raises(UnusableInput, match="do not tell the parameters apart"):
        optimal_weights(np.ones((1, 5, 2, 2)), 2)
    with pytest.raises(UnusableInput, match="shows in no candidate"):
        optimal_weights(np.zeros((1, 5, 1, 1)), 1)
    with pytest.raises(UnknownName, match="criterion"):
        optimal_weights(polynomial(1), 2, criterion="E")
