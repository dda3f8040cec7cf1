"""The convex solver: optimality on the full data, unexcited columns, errors, blocks."""

from __future__ import annotations

import doctest
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear, nnls

import bondgraph.hysteresis.fitting
from bondgraph.hysteresis import BadInput, BadParameter
from bondgraph.hysteresis.fitting import fit_linear_blocks
from bondgraph.hysteresis.fitting.bounded import bounded_least_squares
from bondgraph.hysteresis.fitting.reduction import reduce_blocks

quick = settings(max_examples=30, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)
NNLS = "scipy.optimize.nnls"
MODULES = [
    f"bondgraph.hysteresis.fitting.{m.name}"
    for m in iter_modules(bondgraph.hysteresis.fitting.__path__)
]


def fit_linear_weights(phi: Any, y: Any, constraint: Any = "non_negative", **options: Any) -> Any:
    """Fit of all samples in one block."""
    return fit_linear_blocks(
        ((np.asarray(phi, float), np.asarray(y, float)),), constraint, **options
    )


def random_problem(rng: np.random.Generator, *, decades: float = 6.0) -> tuple[Any, Any]:
    """Correlated columns of different sizes; truth of either sign; noise."""
    n_samples, n = int(rng.integers(30, 120)), int(rng.integers(1, 12))
    mix = rng.normal(size=(n, n)) + 0.5
    phi = rng.normal(size=(n_samples, n)) @ mix * 10.0 ** rng.uniform(-decades, decades, n)
    truth = rng.normal(size=n) / np.linalg.norm(phi, axis=0)
    return phi, phi @ truth + rng.normal(0.0, 0.05, n_samples)


def gradient(phi: Any, fit: Any, y: Any) -> Any:
    """Gradient of the misfit in the unknowns that carry the bounds, columns scaled to norm 1."""
    basis = phi
    if fit.constraint == "prefix_sums":
        basis = phi - np.column_stack((phi[:, 1:], np.zeros(len(y))))
    residual = phi @ fit.weights + fit.offset - y
    return basis.T @ residual / (np.linalg.norm(basis, axis=0) * np.linalg.norm(y))


@pytest.mark.parametrize("name", ["bondgraph.hysteresis.fitting", *MODULES])
def test_examples_run(name: Any) -> None:
    assert doctest.testmod(import_module(name)).failed == 0


@quick
@given(
    seed=seeds,
    constraint=st.sampled_from(["none", "non_negative", "prefix_sums"]),
    offset=st.booleans(),
)
def test_the_solution_is_optimal_on_the_full_data(seed: Any, constraint: Any, offset: Any) -> None:
    """Karush, Kuhn, Tucker: feasible, gradient 0 where free, not negative where bound."""
    rng = np.random.default_rng(seed)
    # A sum of weights makes sense only for columns of one unit.
    phi, y = random_problem(rng, decades=0.5 if constraint == "prefix_sums" else 6.0)
    minimum = 0.0 if constraint == "none" else rng.uniform(0.0, 0.1)
    fit = fit_linear_weights(phi, y, constraint, minimum=minimum, offset=offset)
    slack = np.cumsum(fit.weights) if constraint == "prefix_sums" else fit.weights
    slope = gradient(phi, fit, y)
    size = np.abs(fit.weights).max() + minimum
    free = [i for i in range(phi.shape[1]) if i not in fit.active]
    assert np.max(np.abs(slope[free]), initial=0.0) < 1e-9
    if constraint == "none":
        assert fit.active == ()
    else:
        assert np.all(slack >= minimum - 1e-12 * size)
        assert np.allclose(slack[list(fit.active)], minimum, atol=1e-12 * size)
        assert np.all(slope[list(fit.active)] > -1e-9)
    if offset:
        assert abs(np.mean(phi @ fit.weights + fit.offset - y)) < 1e-9 * np.abs(y).max()
    rms = np.sqrt(np.mean((phi @ fit.weights + fit.offset - y) ** 2))
    assert fit.rms == pytest.approx(rms, rel=1e-9)


@quick
@given(seed=seeds)
def test_no_other_solver_does_better(seed: Any) -> None:
    phi, y = random_problem(np.random.default_rng(seed))
    scale = np.linalg.norm(phi, axis=0)
    other = lsq_linear(phi / scale, y, (0.0, np.inf), method="bvls", tol=1e-14)
    fit = fit_linear_weights(phi, y)
    assert fit.rms**2 * y.size <= 2.0 * other.cost * (1.0 + 1e-9) + 1e-20
    np.testing.assert_allclose(fit.weights * scale, other.x, atol=1e-6 * np.abs(other.x).max())


def test_a_solver_that_cycles_is_replaced(monkeypatch: Any) -> None:
    phi, y = random_problem(np.random.default_rng(3))
    expected = fit_linear_weights(phi, y)

    def cycles(*_: Any, **__: Any) -> Any:
        raise RuntimeError("Maximum number of iterations reached.")

    monkeypatch.setattr(NNLS, cycles)
    found = fit_linear_weights(phi, y)
    assert found.active == expected.active
    np.testing.assert_allclose(found.weights, expected.weights, rtol=1e-6)


def test_half_precision_of_the_solver_is_repaired(monkeypatch: Any) -> None:
    phi, y = random_problem(np.random.default_rng(5))
    expected = fit_linear_weights(phi, y)
    exact = nnls
    monkeypatch.setattr(NNLS, lambda *a, **k: (exact(*a, **k)[0] * (1 + 1e-6), 0.0))
    np.testing.assert_allclose(fit_linear_weights(phi, y).weights, expected.weights, rtol=1e-12)


def test_ill_conditioned_columns_keep_half_the_digits() -> None:
    """Normal equations would lose everything: their condition number is 1e18."""
    rng = np.random.default_rng(0)
    base = rng.normal(size=(200, 1))
    phi = base + 1e-8 * rng.normal(size=(200, 3))
    fit = fit_linear_weights(phi, phi @ [1.0, 2.0, 3.0])
    assert fit.condition > 1e7
    np.testing.assert_allclose(fit.weights, [1.0, 2.0, 3.0], atol=1e-6)


def test_unbounded_unknowns_are_projected_out() -> None:
    rng = np.random.default_rng(1)
    matrix, target = rng.normal(size=(9, 4)), rng.normal(size=9)
    lower = np.array([-np.inf, 0.2, -np.inf, 0.0])
    s, on_bound = bounded_least_squares(matrix, target, lower)
    other = lsq_linear(matrix, target, (lower, np.inf), method="bvls", tol=1e-14)
    np.testing.assert_allclose(s, other.x, atol=1e-12)
    np.testing.assert_array_equal(on_bound, other.active_mask == -1)


@quick
@given(seed=seeds)
def test_blocks_do_not_matter(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    phi, y = random_problem(rng, decades=0.5)
    cuts = np.sort(rng.integers(1, y.size, 3))
    pieces = zip(np.split(phi, cuts), np.split(y, cuts), strict=True)
    whole = fit_linear_weights(phi, y, "prefix_sums")
    parts = fit_linear_blocks([(a, b) for a, b in pieces if b.size], "prefix_sums")
    scale = np.linalg.norm(phi, axis=0)
    np.testing.assert_allclose(
        parts.weights * scale, whole.weights * scale, atol=1e-7 * np.abs(y).max()
    )
    assert parts.rms == pytest.approx(whole.rms, rel=1e-9)


def test_the_triangle_has_the_inner_products() -> None:
    tall = np.random.default_rng(2).normal(size=(50, 4))
    reduced = reduce_blocks([tall[:3], tall[3:20], tall[20:]])
    np.testing.assert_allclose(reduced.triangle.T @ reduced.triangle, tall.T @ tall, atol=1e-12)
    assert reduced.n_rows == 50
    with pytest.raises(ValueError, match="no blocks"):
        reduce_blocks([])


def test_standard_errors_are_those_of_repeated_noise() -> None:
    rng = np.random.default_rng(4)
    phi = rng.normal(size=(60, 3)) @ rng.normal(size=(3, 3))
    truth = np.array([2.0, 1.0, 3.0])
    fits = [
        fit_linear_weights(
            phi, phi @ truth + 5.0 + rng.normal(0, 0.1, 60), "prefix_sums", offset=True
        )
        for _ in range(400)
    ]
    spread = np.std([f.weights for f in fits], axis=0)
    stated = np.sqrt(np.mean([f.standard_errors**2 for f in fits], axis=0))
    np.testing.assert_allclose(stated, spread, rtol=0.12)
    offsets = np.std([f.offset for f in fits])
    assert np.mean([f.offset_error for f in fits]) == pytest.approx(offsets, rel=0.12)


def test_dependent_and_still_columns_are_dropped_with_reasons() -> None:
    rng = np.random.default_rng(6)
    a, b = rng.normal(size=(2, 80))
    phi = np.column_stack((a, np.zeros(80), b, a + 2.0 * b, np.full(80, 3.0), np.full(80, 5.0)))
    y = 2.0 * a + 3.0 * b + 1.5
    fit = fit_linear_weights(phi, y, "none")
    np.testing.assert_allclose(fit.weights, [2.0, 0.0, 3.0, 0.0, 0.5, 0.0], atol=1e-12)
    by_index = {s.index: s for s in fit.unexcited}
    assert sorted(by_index) == [1, 3, 4, 5]
    assert by_index[1].action == "dropped"
    assert "never moves" in by_index[1].reason
    assert by_index[3].reason.endswith("combination of operator 0, operator 2")
    assert by_index[4].action == "kept"
    assert "offset" in by_index[4].reason
    assert np.isinf(fit.standard_errors[[1, 3, 5]]).all()
    assert np.isfinite(fit.standard_errors[[0, 2, 4]]).all()
    with_offset = fit_linear_weights(phi, y, "none", offset=True)
    assert with_offset.offset == pytest.approx(1.5)
    assert [s.index for s in with_offset.unexcited if s.action == "dropped"] == [1, 3, 4, 5]


def test_dropped_columns_repeat_the_partial_sum() -> None:
    """The bound of a dropped operator passes to the sum that it repeats."""
    rng = np.random.default_rng(8)
    a, b = rng.normal(size=(2, 80))
    phi = np.column_stack((a, np.zeros(80), b))
    fit = fit_linear_weights(phi, a - 2.0 * b, "prefix_sums", minimum=[0.0, 1.5, 0.5])
    sums = np.cumsum(fit.weights)
    assert sums[1] >= 1.5 - 1e-12
    assert sums[2] == pytest.approx(0.5)


def test_as_many_samples_as_weights() -> None:
    fit = fit_linear_weights(np.eye(3) + 1.0, [2.0, 3.0, 4.0], "none")
    np.testing.assert_allclose((np.eye(3) + 1.0) @ fit.weights, [2.0, 3.0, 4.0], atol=1e-12)
    assert np.isinf(fit.standard_errors).all()


@pytest.mark.parametrize(
    ("phi", "y", "options", "error", "words"),
    [
        ([[1.0, 2.0]], [1], {}, BadInput, "1 samples cannot determine 2 weights"),
        ([[1.0], [1.0]], [1, 2], {}, BadInput, "none of the 1 operators moves"),
        ([[1.0], [2.0]], [1, 2], {"constraint": "positive"}, BadParameter, "'positive'"),
        ([[1.0], [2.0]], [1, 2], {"minimum": -1.0}, BadParameter, "minimum = -1"),
        ([[1.0], [2.0]], [1, 2], {"minimum": [1.0, 2.0]}, BadParameter, "one number or 1"),
    ],
)
def test_bad_input_is_named(phi: Any, y: Any, options: Any, error: Any, words: Any) -> None:
    with pytest.raises(error, match=words):
        fit_linear_weights(phi, y, **options)
