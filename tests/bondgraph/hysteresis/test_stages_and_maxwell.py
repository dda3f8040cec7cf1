"""Dead zones, Ang, Al Janaideh, Maxwell and the loop with a capacitor."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    BadParameter,
    DeadZones,
    MaxwellResistiveCapacitor,
    NotInvertible,
    PrandtlIshlinskii,
    dead_zone,
    identity_plus,
    inverse_of_identity_plus,
)
from bondgraph.support.ops import CASADI, NUMPY

quick = settings(max_examples=30, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize(
    ("y", "d", "side", "expected"),
    [(3, 1, 1, 2), (0, 1, 1, 0), (-3, -1, -1, -2), (0, -1, -1, 0), (-3, 0, 0, -3)],
)
def test_dead_zone(y: Any, d: Any, side: Any, expected: Any) -> None:
    assert dead_zone(NUMPY, float(y), float(d), side) == expected


@quick
@given(seed=seeds)
def test_dead_zone_inverse(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    left, right = rng.integers(0, 5, 2)
    slopes = rng.uniform(0.3, 3, left + right + 1)
    weights = np.concatenate(
        (
            -np.diff(slopes[: left + 1]),
            [slopes[left]],
            np.diff(slopes[left:]),
        )
    )
    below = -np.cumsum(rng.uniform(0.1, 1, left))[::-1]
    zones = DeadZones((*below, 0.0, *np.cumsum(rng.uniform(0.1, 1, right))), tuple(weights))
    y = np.linspace(-6, 6, 301)
    z, _ = zones.run(y, ())
    assert np.all(np.diff(z) > 0)
    np.testing.assert_allclose(zones.inverse().run(z, ())[0], y, atol=1e-11)
    np.testing.assert_allclose(zones.inverse().inverse().thresholds, zones.thresholds, atol=1e-11)


def test_dead_zone_symbols() -> None:
    d = ca.SX.sym("d", 2)
    zones = DeadZones((-d[0], 0, d[1]), (1.0, 2.0, 3.0))
    y = ca.SX.sym("y")
    there = zones.value(CASADI, y, ())
    f = ca.Function("f", [y, d], [there, zones.inverse().value(CASADI, there, ())])
    for at in (-2.0, 0.2, 3.0):
        z, back = f(at, [0.5, 0.7])
        expected = DeadZones((-0.5, 0, 0.7), (1, 2, 3)).value(NUMPY, at, ())
        assert float(z) == pytest.approx(float(expected))
        assert float(back) == pytest.approx(at)


@pytest.mark.parametrize(
    ("weights", "index"), [((0.1, 0.0, 0.1), 1), ((1.0, 1.0, -2.0), 2), ((-1.0, 1.0, 1.0), 0)]
)
def test_dead_zone_not_invertible(weights: Any, index: Any) -> None:
    with pytest.raises(NotInvertible, match=rf"thresholds\[{index}\]") as caught:
        DeadZones((-1.0, 0.0, 1.0), weights).inverse()
    assert caught.value.index == index


@pytest.mark.parametrize(
    ("thresholds", "message"),
    [((1.0, 2.0), "0 times"), ((0.0, 0.0), "not above"), ((0.0, -1.0), "not above")],
)
def test_dead_zone_bad_thresholds(thresholds: Any, message: Any) -> None:
    with pytest.raises(BadParameter, match=message):
        DeadZones(thresholds, (1.0, 1.0))


def test_dead_zone_number_on_the_wrong_side_of_a_symbol() -> None:
    with pytest.raises(BadParameter, match="wrong side"):
        DeadZones((1.0, sympy.Symbol("d"), 0.0), (1.0, 1.0, 1.0))


def test_ang_stages_are_checked() -> None:
    zones = DeadZones((0.0,), (1.0,))
    with pytest.raises(BadParameter, match="play must be"):
        Ang(zones, zones)  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match="dead_zone must be"):
        Ang(PrandtlIshlinskii((0.0,), (1.0,)), None)  # type: ignore[arg-type]


def test_ang_inverse_twice_is_the_operator() -> None:
    again = Ang.stack_2hz().inverse().inverse()
    np.testing.assert_allclose(again.play.weights, Ang.stack_2hz().play.weights, atol=1e-22)
    np.testing.assert_allclose(again.dead_zone.thresholds, (0, 342.58e-9), rtol=1e-12)


def test_al_janaideh_without_its_envelope() -> None:
    operator = AlJanaideh(q=1.0, c=1.5, sigma=0.4, alpha=0.5, beta=0.3, count=6)
    x = np.random.default_rng(0).uniform(-3, 3, 100)
    np.testing.assert_allclose(
        operator.run(x)[0], operator.as_prandtl_ishlinskii().run(x)[0], atol=1e-12
    )
    inverse, plain = operator.inverse(), operator.as_prandtl_ishlinskii().inverse()
    np.testing.assert_allclose(inverse.thresholds, plain.thresholds, atol=1e-14)
    np.testing.assert_allclose(inverse.weights, plain.weights, atol=1e-14)
    assert float(operator.loop_loss(2.0)) == pytest.approx(
        float(operator.as_prandtl_ishlinskii().loop_loss(2.0))
    )


def test_al_janaideh_has_one_number_too_many() -> None:
    scale = 2.7
    a = AlJanaideh(q=1.0, c=1.5, sigma=0.4, alpha=0.5, beta=0.3, count=6)
    b = AlJanaideh(
        q=a.q / scale,
        c=a.c * scale,
        sigma=a.sigma * scale,
        alpha=a.alpha / scale,
        beta=a.beta / scale,
        count=6,
    )
    x = np.random.default_rng(0).uniform(-3, 3, 100)
    np.testing.assert_allclose(a.run(x)[0], b.run(x)[0], atol=1e-12)


def test_al_janaideh_symbols() -> None:
    p = ca.SX.sym("p", 5)
    operator = AlJanaideh(p[0], p[1], p[2], p[3], p[4], count=3)
    x = ca.SX.sym("x")
    memory = operator.initial_memory(0.2, ops=CASADI)
    inverse = operator.inverse(ops=CASADI)
    z = operator.value(CASADI, x, memory)
    back = inverse.value(CASADI, z, operator.inverse_memory(memory, ops=CASADI))
    f = ca.Function("f", [x, p], [z, back, ca.jacobian(z, p)])
    point = [1.0, 1.5, 0.4, 0.5, 0.3]
    numeric = AlJanaideh(1.0, 1.5, 0.4, 0.5, 0.3, count=3)
    z0, back0, slope = f(1.1, point)
    assert float(z0) == pytest.approx(float(numeric.value(NUMPY, 1.1, numeric.initial_memory(0.2))))
    assert float(back0) == pytest.approx(1.1)
    h = 1e-6
    for i, unit in enumerate(np.eye(5)):
        above, below = f(1.1, point + h * unit)[0], f(1.1, point - h * unit)[0]
        assert float(slope[i]) == pytest.approx(float(above - below) / (2 * h), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"c": 0.0}, "c = 0.0 must be positive"),
        ({"sigma": -1.0}, "sigma"),
        ({"count": 2.5}, "count = 2.5 must be an integer"),
        ({"q": np.nan}, "q = nan must be finite"),
    ],
)
def test_al_janaideh_bad_parameters(change: Any, message: Any) -> None:
    good = {"q": 1.0, "c": 1.0, "sigma": 1.0, "alpha": 1.0, "beta": 1.0, "count": 2}
    with pytest.raises(BadParameter, match=message):
        AlJanaideh(**(good | change))


def test_maxwell_is_plays() -> None:
    operator = MaxwellResistiveCapacitor.stack_2hz()
    plays = operator.as_prandtl_ishlinskii()
    q = 1e-6 * np.random.default_rng(1).uniform(-200, 200, 300)
    f, memory = operator.run(q)
    g, same = plays.run(q)
    np.testing.assert_allclose(f, g, atol=1e-11)
    assert memory == same
    with pytest.raises(NotInvertible) as caught:
        plays.inverse()
    assert caught.value.index == 15


def test_maxwell_table_in_any_order_and_merged() -> None:
    operator = MaxwellResistiveCapacitor.from_table([2.0, 1.0, 4.0], [3.0, 1.0, 1.5])
    assert operator.stiffnesses == (1.0, 0.75)
    assert operator.breakaways == (1.0, 4.5)


@quick
@given(seed=seeds)
def test_maxwell_energy_closes(seed: Any) -> None:
    """Work in = energy stored + friction loss >= energy stored; a closed loop loses the formula."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    slips, k = np.cumsum(rng.uniform(0.1, 0.5, n)), rng.uniform(0.1, 2, n)
    operator = MaxwellResistiveCapacitor(tuple(k), tuple(k * slips))
    start, amplitude = rng.uniform(-2, 2), rng.uniform(0.05, 2)
    top = start + 2 * amplitude
    _, memory = operator.run([*rng.uniform(-4, 4, 9), start, top, start])
    corners = np.unique([0.0, *(2 * s for s in slips if s < amplitude), 2 * amplitude])
    q = np.concatenate((start + corners, (top - corners)[1:]))
    f, after = operator.run(q, memory)
    work = np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(q))
    assert work == pytest.approx(float(operator.loop_loss(amplitude)), rel=1e-9, abs=1e-11)
    stored = [float(operator.stored_energy(NUMPY, start, m)) for m in (memory, after)]
    assert stored[0] == pytest.approx(stored[1], abs=1e-11)


@pytest.mark.parametrize(
    ("stiffnesses", "breakaways", "message"),
    [
        ((1.0, 1.0), (2.0, 1.0), r"slip points .*\[1\] = 1.0 is not above"),
        ((0.0,), (1.0,), r"stiffnesses\[0\] = 0.0 must be positive"),
        ((1.0,), (-1.0,), r"breakaways\[0\] = -1.0 must be positive"),
        ((), (), "empty"),
        ((1.0,), (1.0, 2.0), "1 entries but breakaways has 2"),
    ],
)
def test_maxwell_bad_parameters(stiffnesses: Any, breakaways: Any, message: Any) -> None:
    with pytest.raises(BadParameter, match=message):
        MaxwellResistiveCapacitor(stiffnesses, breakaways)


def test_capacitor_in_series_with_hysteresis() -> None:
    """The solution satisfies q + C H(q) = w from a memory with a past, in volts."""
    operator = MaxwellResistiveCapacitor.stack_2hz()
    c = 1.5e-6
    rng = np.random.default_rng(2)
    _, memory = operator.run(1e-6 * rng.uniform(-200, 200, 30))
    w = 1e-6 * rng.uniform(-200, 200, 500)
    solution = inverse_of_identity_plus(c, operator)
    q, _ = solution.run(w, identity_plus(c, operator).inverse_memory(memory))
    v, _ = operator.run(q, memory)
    assert np.max(np.abs(q + c * v - w)) / c < 1e-12 * np.max(np.abs(w)) / c
    assert np.max(np.abs(q + c * v - w)) / c < 1e-12


def test_capacitor_with_symbols() -> None:
    c, k, w = ca.SX.sym("c"), ca.SX.sym("k", 2), ca.SX.sym("w")
    v = (1.0, 2.5)
    operator = MaxwellResistiveCapacitor((k[0], k[1]), v)
    m: Any = ca.SX.sym("m", 2)
    solution = inverse_of_identity_plus(c, operator)
    memory = identity_plus(c, operator).inverse_memory(m)
    q = solution.value(CASADI, w, memory)
    residual = ca.Function("f", [w, m, c, k], [q + c * operator.value(CASADI, q, m) - w])
    numeric = MaxwellResistiveCapacitor((1.3, 0.8), v)
    for seed in range(10):
        rng = np.random.default_rng(seed)
        _, states = numeric.run(rng.uniform(-5, 5, 10))
        assert abs(float(residual(rng.uniform(-9, 9), states, 0.7, [1.3, 0.8]))) < 1e-13


def test_capacitor_bad_gain() -> None:
    operator = MaxwellResistiveCapacitor((1.0,), (1.0,))
    with pytest.raises(BadParameter, match=r"c = -1\.0 must be zero or positive"):
        inverse_of_identity_plus(-1.0, operator)
