"""Prandtl-Ishlinskii: inverse, congruency, losses, symbols, invertibility."""

from __future__ import annotations

import pickle
from typing import Any

import casadi as ca
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import BadMemory, BadParameter, NotInvertible, PrandtlIshlinskii
from bondgraph.support.ops import CASADI, NUMPY

quick = settings(max_examples=30, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)


def random_operator(rng: np.random.Generator, *, n: int | None = None) -> PrandtlIshlinskii:
    """Weights of either sign with every slope in [0.3, 3]."""
    n = int(rng.integers(0, 12)) if n is None else n
    slopes = rng.uniform(0.3, 3.0, n + 1)
    thresholds = np.concatenate(([0.0], np.cumsum(rng.uniform(0.05, 0.6, n))))
    return PrandtlIshlinskii(tuple(thresholds), tuple(np.diff(slopes, prepend=0.0)))


def area(x: Any, y: Any) -> Any:
    """Cyclic integral of x dy, exact for piecewise linear loops sampled at their corners."""
    return np.sum(0.5 * (x[1:] + x[:-1]) * np.diff(y))


@quick
@given(seed=seeds)
def test_inverse_from_random_states(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    operator = random_operator(rng)
    x0 = rng.uniform(-3, 3)
    memory = operator.initial_memory(x0, tuple(rng.uniform(-6, 6, operator.n_memory)))
    x = np.concatenate(([x0], rng.uniform(-5, 5, 80)))
    z, _ = operator.run(x, memory)
    back, _ = operator.inverse().run(z, operator.inverse_memory(memory))
    assert np.max(np.abs(back - x)) < 1e-9 * np.max(np.abs(x))


@quick
@given(seed=seeds)
def test_inverse_twice_is_the_operator(seed: Any) -> None:
    operator = random_operator(np.random.default_rng(seed))
    again = operator.inverse().inverse()
    np.testing.assert_allclose(again.thresholds, operator.thresholds, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(again.weights, operator.weights, rtol=1e-9, atol=1e-12)


@quick
@given(seed=seeds)
def test_congruency(seed: Any) -> None:
    """Minor loops between the same inputs differ by a shift only, whatever the past."""
    rng = np.random.default_rng(seed)
    operator = random_operator(rng)
    low, high = np.sort(rng.uniform(-3, 3, 2))
    loop = np.concatenate((np.linspace(low, high, 20), np.linspace(high, low, 20)))
    loops = []
    for _ in range(2):
        past = rng.uniform(-5, 5, 30)
        _, memory = operator.run([*past, low, high, low])
        loops.append(operator.run(loop, memory)[0])
    shift = loops[0] - loops[1]
    assert np.ptp(shift) < 1e-11


@quick
@given(seed=seeds)
def test_loop_loss(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    operator = random_operator(rng)
    centre, amplitude = rng.uniform(-2, 2), rng.uniform(0.1, 4)
    corners = np.array([0.0, *(2 * r for r in operator.thresholds if r < amplitude), 2 * amplitude])
    corners = np.unique(corners)
    x = centre - amplitude + np.concatenate((corners, (2 * amplitude - corners)[1:]))
    _, memory = operator.run([*rng.uniform(-5, 5, 9), x[0], x.max(), x[0]])
    y, _ = operator.run(x, memory)
    assert area(x, y) == pytest.approx(float(operator.loop_loss(amplitude)), rel=1e-9, abs=1e-11)


def test_regressors_times_weights_is_the_output() -> None:
    rng = np.random.default_rng(4)
    operator = random_operator(rng, n=5)
    x = rng.uniform(-3, 3, 200)
    phi = operator.regressors(x)
    assert phi.shape == (200, 6)
    np.testing.assert_allclose(phi @ operator.weights, operator.run(x)[0], atol=1e-12)
    unknown = PrandtlIshlinskii(operator.thresholds, tuple(ca.vertsplit(ca.SX.sym("w", 6))))
    np.testing.assert_array_equal(unknown.regressors(x), phi)


def test_slopes() -> None:
    operator = PrandtlIshlinskii((0.0, 1.0, 2.0), (1.0, 0.5, 0.25))
    assert operator.slope_full == 1.75


@pytest.mark.parametrize("matrix", [ca.SX, ca.MX])
def test_casadi_weights_thresholds_and_inverse(matrix: Any) -> None:
    n = 4
    numeric = random_operator(np.random.default_rng(2), n=n)
    w, r, x = matrix.sym("w", n + 1), matrix.sym("r", n), matrix.sym("x")
    m = matrix.sym("m", n)
    symbolic = PrandtlIshlinskii((0, *ca.vertsplit(r)), tuple(ca.vertsplit(w)))
    inverse = symbolic.inverse()
    compiled = ca.Function(
        "f",
        [x, m, w, r],
        [
            symbolic.value(CASADI, x, m),
            inverse.value(CASADI, x, symbolic.inverse_memory(m)),
            symbolic.loop_loss(x, ops=CASADI),
        ],
    )
    _, memory = numeric.run(np.random.default_rng(3).uniform(-3, 3, 20))
    forward, back, loss = compiled(1.3, memory, numeric.weights, numeric.thresholds[1:])
    expected = numeric.inverse().value(NUMPY, 1.3, numeric.inverse_memory(memory))
    assert float(forward) == pytest.approx(float(numeric.value(NUMPY, 1.3, memory)), rel=1e-13)
    assert float(back) == pytest.approx(float(expected), rel=1e-12)
    assert float(loss) == pytest.approx(float(numeric.loop_loss(1.3)), rel=1e-12)


def test_derivative_by_weights_and_thresholds() -> None:
    n = 4
    numeric = random_operator(np.random.default_rng(6), n=n)
    w, r = ca.SX.sym("w", n + 1), ca.SX.sym("r", n)
    m: Any = ca.SX.sym("m", n)
    x = ca.SX.sym("x")
    operator = PrandtlIshlinskii((0, *ca.vertsplit(r)), tuple(ca.vertsplit(w)))
    for target in (operator, operator.inverse()):
        states = m if target is operator else operator.inverse_memory(m)
        y = target.value(CASADI, x, states)
        f = ca.Function("f", [w, r, x, m], [y, ca.jacobian(y, ca.vertcat(w, r))])
        _, memory = numeric.run(np.random.default_rng(7).uniform(-2, 2, 20))
        point = np.array([*numeric.weights, *numeric.thresholds[1:]])

        def output(p: Any, f: Any = f, memory: Any = memory) -> Any:
            return float(f(p[: n + 1], p[n + 1 :], 0.77, memory)[0])

        gradient = np.array(f(point[: n + 1], point[n + 1 :], 0.77, memory)[1]).ravel()
        h = 1e-6
        for i, unit in enumerate(np.eye(point.size)):
            quotient = (output(point + h * unit) - output(point - h * unit)) / (2 * h)
            assert gradient[i] == pytest.approx(quotient, rel=1e-6, abs=1e-8)


def test_sympy_inverse_is_exact_algebra() -> None:
    w = sympy.symbols("w_0:3", positive=True)
    r = sympy.symbols("r_1:3", positive=True)
    operator = PrandtlIshlinskii((0, *r), w)
    inverse = operator.inverse()
    assert sympy.simplify(inverse.thresholds[2] - (w[0] * r[1] + w[1] * (r[1] - r[0]))) == 0
    expected = -w[2] / ((w[0] + w[1] + w[2]) * (w[0] + w[1]))
    assert sympy.simplify(inverse.weights[2] - expected) == 0
    again = inverse.inverse()
    assert all(sympy.simplify(a - b) == 0 for a, b in zip(again.weights, w, strict=True))
    assert sympy.simplify(again.thresholds[2] - r[1]) == 0


def test_symbolic_parameters_cannot_run_or_be_saved() -> None:
    operator = PrandtlIshlinskii((0.0, 1.0), (1.0, sympy.Symbol("w")))
    with pytest.raises(BadParameter, match=r"weights\[1\] = w is symbolic"):
        operator.run([0.0, 1.0])
    with pytest.raises(BadParameter, match=r"weights\[1\] = w is symbolic"):
        operator.to_dict()


@pytest.mark.parametrize(
    ("weights", "index"),
    [((0.0, 1.0), 0), ((-1.0, 3.0), 0), ((1.0, -1.5, 1.0), 1), ((0.3, 0.1, -0.4), 2)],
)
def test_not_invertible_names_the_index(weights: Any, index: Any) -> None:
    operator = PrandtlIshlinskii(tuple(range(len(weights))), weights)
    with pytest.raises(NotInvertible, match=rf"weights\[{index}\]") as caught:
        operator.inverse()
    assert caught.value.index == index
    assert pickle.loads(pickle.dumps(caught.value)).index == index


@pytest.mark.parametrize(
    ("thresholds", "weights", "message"),
    [
        ((0.0, 2.0, 1.0), (1, 1, 1), r"thresholds\[2\] = 1.0 is not above"),
        ((0.0, 1.0, 1.0), (1, 1, 1), r"thresholds\[2\] = 1.0 is not above"),
        ((0.0, -1.0), (1, 1), r"thresholds\[1\] = -1.0 must be zero or positive"),
        ((0.5, 1.0), (1, 1), r"thresholds\[0\] = 0.5 must be 0"),
        ((), (), r"thresholds\[0\] = missing"),
        ((0.0, 1.0), (1, 1, 1), "2 entries but weights has 3"),
        ((0.0, 1.0), (1, np.nan), r"weights\[1\] = nan must be finite"),
        ((0.0, 1.0), (1, "a"), r"weights\[1\] = 'a'"),
        ((0.0, 1.0), (1, True), r"weights\[1\] = True"),
        (1.0, (1,), "thresholds = 1.0 must be a sequence"),
        ((0.0, 1.0), (1, np.ones(3)), r"weights\[1\] must be a scalar"),
    ],
)
def test_bad_parameters_name_the_entry(thresholds: Any, weights: Any, message: Any) -> None:
    with pytest.raises(BadParameter, match=message):
        PrandtlIshlinskii(thresholds, weights)


def test_memory_of_another_operator_is_refused() -> None:
    operator = PrandtlIshlinskii((0.0, 1.0), (1.0, 1.0))
    for call in (operator.inverse_memory, lambda m: operator.regressors([0.0], m)):
        with pytest.raises(BadMemory, match="has 1 memory states"):
            call((0.0, 1.0))
    with pytest.raises(BadMemory, match=r"memory\[0\] = nan"):
        operator.run([0.0], [np.nan])
