"""What every operator of the catalogue promises, on fixed examples and on random ones."""

from __future__ import annotations

import json
from typing import Any

import casadi as ca
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import (
    OPERATORS,
    Ang,
    BadInput,
    BadMemory,
    BadParameter,
    operator_from_dict,
    turning_points,
)
from bondgraph.hysteresis.numeric_inverse import numeric_inverse
from bondgraph.support.ops import CASADI, NUMPY, SYMPY
from tests.bondgraph.hysteresis.examples import (
    EVERY,
    EXAMPLES,
    PI,
    STEP,
    UNTIMED,
    invertible,
    step_by_step,
    wander,
    wandered_memory,
)

quick = settings(max_examples=30, deadline=None, derandomize=True, database=None)
every = pytest.mark.parametrize("operator", UNTIMED.values(), ids=UNTIMED.keys())
each = pytest.mark.parametrize("operator", EXAMPLES.values(), ids=EXAMPLES.keys())
any_of_all = pytest.mark.parametrize("operator", EVERY.values(), ids=EVERY.keys())
seeds = st.integers(0, 2**32 - 1)


def test_every_kind_has_an_example() -> None:
    assert {operator.kind for operator in EXAMPLES.values()} == set(OPERATORS)


@pytest.mark.sampled(every=2)
@every
@quick
@given(seed=seeds)
def test_run_equals_steps(operator: Any, seed: Any) -> None:
    memory, _ = wandered_memory(operator, seed)
    x = wander(seed + 1, n=1 + seed % 40)
    fast, after_fast = operator.run(x, memory)
    slow, after_slow = step_by_step(operator, x, memory)
    np.testing.assert_allclose(fast, slow, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.array(after_slow, float), after_fast, rtol=1e-13, atol=1e-13)


@every
def test_run_over_more_than_one_chunk(operator: Any) -> None:
    x = wander(5, n=10_001)
    whole, after = operator.run(x)
    first, between = operator.run(x[:3000])
    second, last = operator.run(x[3000:], between)
    np.testing.assert_allclose(whole, np.concatenate((first, second)), rtol=1e-13, atol=1e-13)
    assert after == last


@every
@quick
@given(seed=seeds, samples=st.integers(1, 30))
def test_rate_independence(operator: Any, seed: Any, samples: Any) -> None:
    turns = wander(seed, n=20)
    grid = np.arange((turns.size - 1) * samples + 1) / samples
    x = np.interp(grid, np.arange(turns.size), turns)
    index = turning_points(x)
    memory = operator.initial_memory(float(x[0]))
    dense, after_dense = operator.run(x, memory)
    sparse, after_sparse = operator.run(x[index], memory)
    np.testing.assert_allclose(dense[index], sparse, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(after_dense, after_sparse, rtol=1e-13, atol=1e-13)


@every
@quick
@given(seed=seeds)
def test_wiping_out(operator: Any, seed: Any) -> None:
    """A minor excursion that returns to its turning point leaves no trace, where it is claimed."""
    if not operator.wipes_out:
        return
    memory, _ = wandered_memory(operator, seed)
    rng = np.random.default_rng(seed)
    low, high = np.sort(rng.uniform(-5, 5, 2))
    minor = rng.uniform(low, high, 10)
    _, plain = operator.run([low, high], memory)
    _, detour = operator.run([low, high, *minor, high], memory)
    np.testing.assert_allclose(plain, detour, rtol=1e-14, atol=1e-14)


@every
@quick
@given(seed=seeds)
def test_value_does_not_depend_on_where_steps_are_accepted(operator: Any, seed: Any) -> None:
    memory, x0 = wandered_memory(operator, seed)
    x1 = float(np.random.default_rng(seed).uniform(-5, 5))
    direct = operator.value(NUMPY, x1, memory)
    between = operator.advance(NUMPY, 0.5 * (x0 + x1), memory)
    assert float(operator.value(NUMPY, x1, between)) == pytest.approx(float(direct), abs=1e-13)
    after = operator.advance(NUMPY, x1, memory)
    assert float(operator.value(NUMPY, x1, after)) == pytest.approx(float(direct), abs=1e-13)


@pytest.mark.sampled(every=3)
@any_of_all
def test_array_input_is_many_trial_points(operator: Any) -> None:
    memory, _ = wandered_memory(operator, 3)
    trial = np.linspace(-4, 4, 9)
    together = operator.value(NUMPY, trial, memory, STEP)
    single = [float(operator.value(NUMPY, float(x), memory, STEP)) for x in trial]
    assert together.shape == trial.shape
    bound = 1e-15 if operator.timed else 0.0
    np.testing.assert_allclose(together, single, rtol=bound, atol=bound)


@pytest.mark.sampled(every=3)
@any_of_all
@pytest.mark.parametrize("matrix", [ca.SX, ca.MX])
def test_casadi_agrees(operator: Any, matrix: Any) -> None:
    x, memory, h = matrix.sym("x"), matrix.sym("m", operator.n_memory), matrix.sym("h")
    compiled = ca.Function(
        "f",
        [x, memory, h],
        [operator.value(CASADI, x, memory, h), ca.vertcat(*operator.advance(CASADI, x, memory, h))],
    )
    near, after_near = (1e-12, 1e-12) if operator.timed else (1e-13, 1e-14)
    for seed in range(20):
        states, _ = wandered_memory(operator, seed)
        at = float(np.random.default_rng(seed).uniform(-5, 5))
        value, after = compiled(at, ca.DM(states), STEP)
        assert float(value) == pytest.approx(
            float(operator.value(NUMPY, at, states, STEP)), rel=near, abs=near
        )
        np.testing.assert_allclose(
            np.array(after).ravel(), operator.advance(NUMPY, at, states, STEP),
            rtol=after_near, atol=1e-12 if operator.timed else 0.0,
        )  # fmt: skip


@pytest.mark.sampled(every=3)
@any_of_all
def test_sympy_agrees(operator: Any) -> None:
    """At one memory: building the nested minima of an inverse is what takes its time."""
    x = sympy.Symbol("x", real=True)
    states, _ = wandered_memory(operator, 1)
    value = sympy.sympify(operator.value(SYMPY, x, states, STEP))
    after = [sympy.sympify(m) for m in operator.advance(SYMPY, x, states, STEP)]
    for at in np.random.default_rng(1).uniform(-5, 5, 9):
        expected = float(operator.value(NUMPY, float(at), states, STEP))
        assert float(value.subs(x, at)) == pytest.approx(expected, rel=1e-12)
        np.testing.assert_allclose(
            [float(m.subs(x, at)) for m in after],
            operator.advance(NUMPY, float(at), states, STEP),
            rtol=1e-12,
            atol=1e-12 if operator.timed else 0.0,
        )


@any_of_all
def test_derivative_by_input(operator: Any) -> None:
    """CasADi's derivative is the difference quotient away from kinks."""
    x, memory = ca.SX.sym("x"), ca.SX.sym("m", operator.n_memory)
    slope = ca.Function("s", [x, memory], [ca.jacobian(operator.value(CASADI, x, memory, STEP), x)])
    h, checked = 1e-6, 0
    for seed in range(20):
        states, _ = wandered_memory(operator, seed)
        at = float(np.random.default_rng(seed).uniform(-5, 5))
        below, mid, above = (
            float(operator.value(NUMPY, at + d, states, STEP)) for d in (-h, 0.0, h)
        )
        if abs(above - 2 * mid + below) > 1e-12:
            continue  # a kink lies within the difference
        assert float(slope(at, ca.DM(states))) == pytest.approx((above - below) / (2 * h), rel=1e-7)
        checked += 1
    assert checked >= 10


@every
def test_linear_slope_is_the_slope_after_a_reversal(operator: Any) -> None:
    # Around 0 the dead zones do nothing; the reversal at 0 makes every play rest.
    memory = operator.advance(NUMPY, 0.0, operator.initial_memory(0.0))
    h = 1e-8
    quotient = (operator.value(NUMPY, h, memory) - operator.value(NUMPY, 0.0, memory)) / h
    assert float(quotient) == pytest.approx(operator.linear_slope, rel=1e-6)


@each
def test_json_round_trip(operator: Any) -> None:
    again = operator_from_dict(json.loads(json.dumps(operator.to_dict())))
    assert again == operator
    assert type(operator).from_dict(operator.to_dict()) == operator
    memory, _ = wandered_memory(operator, 8)
    assert operator.memory_from_dict(json.loads(json.dumps(operator.memory_to_dict(memory)))) == (
        memory
    )


@any_of_all
def test_memory_is_a_fixed_point_of_initial_memory(operator: Any) -> None:
    """Given states that a history produced, `initial_memory` returns them."""
    for seed in (*range(8), 11):
        memory, x0 = wandered_memory(operator, seed)
        again = operator.initial_memory(x0, memory)
        near = 1e-12 if operator.timed else 1e-14
        np.testing.assert_allclose(again, memory, rtol=near, atol=near)


@any_of_all
def test_virgin_memory_is_a_straight_way_from_zero(operator: Any) -> None:
    virgin = operator.initial_memory(3.0)
    straight = operator.advance(NUMPY, 3.0, operator.initial_memory(0.0))
    bound = 1e-15 if operator.timed else 0.0
    np.testing.assert_allclose(straight, virgin, rtol=bound, atol=bound)


@pytest.mark.parametrize("name", invertible(UNTIMED))
@quick
@given(seed=seeds)
def test_inverse_from_a_memory_with_a_past(name: Any, seed: Any) -> None:
    operator: Any = UNTIMED[name]
    memory, _ = wandered_memory(operator, seed)
    x = wander(seed + 7)
    z, after = operator.run(x, memory)
    if operator.n_memory:
        back, after_back = operator.inverse().run(z, operator.inverse_memory(memory))
        np.testing.assert_allclose(after_back, operator.inverse_memory(after), atol=1e-10)
    else:
        back, _ = operator.inverse().run(z, ())
    assert np.max(np.abs(back - x)) < 1e-9 * np.max(np.abs(x))


@every
@pytest.mark.parametrize("bad", [[], [[1.0]], [0.0, np.nan], [np.inf]])
def test_bad_records_are_refused(operator: Any, bad: Any) -> None:
    with pytest.raises(BadInput):
        operator.run(bad)


@any_of_all
def test_errors_name_the_culprit(operator: Any) -> None:
    with pytest.raises(BadInput, match=r"x\[2\] = nan"):
        operator.run([0.0, 1.0, np.nan], step=STEP)
    with pytest.raises(BadInput, match="x = nan"):
        operator.advance(NUMPY, float("nan"), operator.initial_memory(), STEP)
    too_long = (0.0,) * (operator.n_memory + 1)
    with pytest.raises(BadMemory, match=f"has {operator.n_memory} memory states"):
        operator.value(NUMPY, 0.0, too_long, STEP)
    with pytest.raises(BadMemory, match="not of"):
        operator.memory_from_dict({"kind": "another", "states": []})
    with pytest.raises(BadMemory, match="states"):
        operator.memory_from_dict({"kind": operator.kind})


def test_foreign_data_are_refused() -> None:
    with pytest.raises(BadParameter, match="no operator kind 'another'"):
        operator_from_dict({"kind": "another"})
    with pytest.raises(BadParameter, match="no operator kind a list"):
        operator_from_dict({"kind": ["ang"]})
    with pytest.raises(BadParameter, match="dead_zone needs its field 'weights'"):
        operator_from_dict({"kind": "dead_zone", "thresholds": [0]})
    with pytest.raises(BadParameter, match=r"weights\[0\]: '2' is not a number"):
        operator_from_dict({"kind": "dead_zone", "thresholds": [0], "weights": ["2"]})
    with pytest.raises(BadParameter, match="hold a dead_zone, not a Ang"):
        Ang.from_dict({"kind": "dead_zone", "thresholds": [0], "weights": [2]})
    with pytest.raises(BadMemory, match="is not finite"):
        PI.memory_from_dict({"kind": PI.kind, "states": [0.0, float("nan"), 0.0]})
    with pytest.raises(BadMemory, match="not a single number"):
        PI.memory_from_dict({"kind": PI.kind, "states": [0.0, "1", 0.0]})


def work(operator: Any, x: Any, memory: Any) -> float:
    """Work over a record at the passive port, exact for outputs straight between the samples."""
    y, _ = operator.run(x, memory, step=STEP / 4000)
    if operator.passive_port == "input":
        return float(np.sum(0.5 * (x[1:] + x[:-1]) * np.diff(y)))
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))


@pytest.mark.sampled(every=2)
@each
@quick
@given(seed=seeds)
def test_energy_ledger_closes(operator: Any, seed: Any) -> None:
    """Work is the rise of the stored energy plus a loss that is never negative."""
    memory, x0 = wandered_memory(operator, seed)
    if operator.passive_port is None:
        with pytest.raises(BadParameter, match="energy"):
            operator.stored_energy(NUMPY, x0, memory)
        return
    memory = operator.advance(NUMPY, x0, memory, STEP)
    for x1 in np.random.default_rng(seed).uniform(-5, 5, 4):
        way = np.linspace(x0, float(x1), 4001)
        fine = STEP / 4000 if operator.timed else None
        size = (abs(x0) + abs(x1)) * np.ptp(operator.run(way, memory, step=fine)[0])
        before = operator.stored_energy(NUMPY, x0, memory)
        lost = float(operator.dissipated_energy(NUMPY, float(x1), memory, STEP))
        rise = float(operator.stored_energy(NUMPY, float(x1), memory, STEP) - before)
        assert lost >= -1e-14 * size
        # a timed operator spends one of the 4001 fine steps before the first sample
        near = 2e-3 * size if operator.timed else 2e-6 * size + 1e-12
        assert work(operator, way, memory) == pytest.approx(rise + lost, abs=near)
        memory, x0 = operator.advance(NUMPY, float(x1), memory, STEP), float(x1)


@every
def test_closed_cycles_of_a_passive_operator_cost_work(operator: Any) -> None:
    if operator.passive_port is None:
        return
    rng = np.random.default_rng(2)
    for _ in range(5):
        corners = rng.uniform(-5, 5, 5)
        cycle = np.interp(np.linspace(0, 5, 4001), np.arange(6), [*corners, corners[0]])
        _, memory = operator.run(cycle)
        spent = work(operator, cycle, memory)
        assert spent >= -1e-5 * np.ptp(cycle) * np.ptp(operator.run(cycle, memory)[0])


@pytest.mark.sampled(every=2)
@every
@quick
@given(seed=seeds)
def test_numeric_inverse(operator: Any, seed: Any) -> None:
    """The input is found back where the output tells it."""
    slope_claim = operator.linear_slope
    memory, x0 = wandered_memory(operator, seed)
    x = wander(seed + 3, n=20)
    y, after = operator.run(x, memory)
    found, left = numeric_inverse(operator, y, memory, start=x0, tolerance=1e-12)
    again, _ = operator.run(found, memory)
    assert slope_claim > 0
    np.testing.assert_allclose(again, y, rtol=0, atol=1e-9 * max(1.0, float(np.abs(y).max())))
    if hasattr(operator, "inverse"):
        np.testing.assert_allclose(found, x, rtol=0, atol=1e-9 * float(np.abs(x).max()))
        np.testing.assert_allclose(left, after, rtol=0, atol=1e-8)
