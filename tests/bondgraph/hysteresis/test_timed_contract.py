"""What timed and composed operators promise, beside what every operator does."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
import sympy

from bondgraph.hysteresis import (
    AlJanaideh,
    BadInput,
    BadMemory,
    DeadZones,
    MaxwellResistiveCapacitor,
    PrandtlIshlinskii,
)
from bondgraph.hysteresis.composed.cascade import Cascade, inverse_memory_of
from bondgraph.hysteresis.composed.parallel import Parallel
from bondgraph.hysteresis.creep.hysteresis_with_creep import HysteresisWithCreep
from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep
from bondgraph.hysteresis.creep.log_creep import LogCreep
from bondgraph.hysteresis.plays.kuhnen_modified import kuhnen_modified
from bondgraph.hysteresis.rate.ang_rate_dependent import AngRateDependent
from bondgraph.hysteresis.rate.rate_dependent import RateDependentPrandtlIshlinskii
from bondgraph.support.ops import CASADI, NUMPY, SYMPY

STEP = 0.02
PI = PrandtlIshlinskii((0.0, 0.3, 1.0, 2.5), (1.2, 0.6, -0.4, 0.9))
ZONES = DeadZones((-2.0, -0.5, 0.0, 0.7, 3.0), (0.3, -0.2, 1.0, 0.5, -0.8))
CREEP = LogCreep((50.0, 5.0, 0.5), (0.0, 0.4), (0.1, 0.2))
LINEAR = KelvinVoigtCreep(1.0, (0.3, -0.1, 0.2), (0.01, 0.1, 3.0))
RATE = RateDependentPrandtlIshlinskii((0, 0.3, 1), (0, 0.002, 0.003), (1.2, 0.6, -0.4), 0.05)
ANG = AngRateDependent((0, 0.3, 1), (1.2, 0.6, -0.4), (0.001, 0.002, 0.0005))
ENVELOPE = AlJanaideh(q=1.0, c=1.5, sigma=0.4, alpha=0.5, beta=0.3, count=4)
MODEL = HysteresisWithCreep(PI, CREEP)
FORWARD: dict[str, Any] = {
    "log_creep": CREEP,
    "kelvin_voigt_creep": LINEAR,
    "hysteresis_with_creep": MODEL,
    "hysteresis_with_creep envelope": HysteresisWithCreep(ENVELOPE, CREEP),
    "hysteresis_with_creep bent line": HysteresisWithCreep(ZONES, CREEP),
    "hysteresis_with_creep rate": HysteresisWithCreep(RATE, CREEP),
    "cascade": Cascade(PI, ZONES),
    "cascade bent input": Cascade(ZONES, PI),
    "cascade full": Cascade(MODEL, ZONES),
    "cascade of two memories": Cascade(PI, ENVELOPE),
    "cascade with linear creep": Cascade(LINEAR, PI),
    "parallel": Parallel(PI, MaxwellResistiveCapacitor((2.0, 1.0), (0.4, 0.5))),
    "parallel with creep": Parallel(PI, LINEAR),
    "rate_dependent": RATE,
    "rate_dependent linear": RateDependentPrandtlIshlinskii((0,), (0,), (2.0,)),
    "ang_rate_dependent": ANG,
    "kuhnen_modified": kuhnen_modified((0, 0.5, 1), (1, 0.5, 0.2), (-1, 1, 3), (0.3, 1, 0.6, 0.2)),
}
INVERTIBLE = {name: f for name, f in FORWARD.items() if hasattr(f, "inverse")}
EVERY = {
    **FORWARD,
    **{f"inverse of {name}": f.inverse() for name, f in INVERTIBLE.items()},
    "closed form": RATE.closed_form_inverse(),
}
every = pytest.mark.parametrize("operator", EVERY.values(), ids=EVERY.keys())
invertible = pytest.mark.parametrize("operator", INVERTIBLE.values(), ids=INVERTIBLE.keys())


def wander(seed: int, n: int = 60, size: float = 5.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.asarray(size * rng.uniform(-1, 1, n) * rng.choice([0.05, 0.3, 1.0], n))


def wandered_memory(operator: Any, seed: int) -> Any:
    x = wander(seed)
    return operator.run(x, step=STEP)[1], float(x[-1])


def step_by_step(operator: Any, x: Any, memory: Any) -> Any:
    outputs = []
    for value in x:
        outputs.append(float(operator.value(NUMPY, float(value), memory, STEP)))
        memory = operator.advance(NUMPY, float(value), memory, STEP)
    return np.array(outputs), memory


@every
def test_run_equals_steps(operator: Any) -> None:
    for seed in range(5):
        memory, _ = wandered_memory(operator, seed)
        x = wander(seed + 100, n=40)
        fast, after_fast = operator.run(x, memory, step=STEP)
        slow, after_slow = step_by_step(operator, x, memory)
        np.testing.assert_allclose(fast, slow, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(after_slow, after_fast, rtol=1e-10, atol=1e-10)


@every
def test_run_in_pieces(operator: Any) -> None:
    x = wander(5, n=2_001)
    whole, after = operator.run(x, step=STEP)
    first, between = operator.run(x[:700], step=STEP)
    second, last = operator.run(x[700:], between, step=STEP)
    np.testing.assert_allclose(whole, np.concatenate((first, second)), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(after, last, rtol=1e-12, atol=1e-12)


@every
def test_a_timed_operator_needs_its_step(operator: Any) -> None:
    if operator.timed:
        for bad in (None, 0.0, -1.0, np.nan):
            with pytest.raises(BadInput, match="give step"):
                operator.run([0.0, 1.0], step=bad)
    else:
        operator.run([0.0, 1.0])


@every
def test_array_input_is_many_trial_points(operator: Any) -> None:
    memory, _ = wandered_memory(operator, 3)
    trial = np.linspace(-4, 4, 9)
    together = operator.value(NUMPY, trial, memory, STEP)
    single = [float(operator.value(NUMPY, float(x), memory, STEP)) for x in trial]
    assert together.shape == trial.shape
    np.testing.assert_allclose(together, single, rtol=1e-15, atol=1e-15)


@every
@pytest.mark.parametrize("matrix", [ca.SX, ca.MX])
def test_casadi_agrees(operator: Any, matrix: Any) -> None:
    x, memory, h = matrix.sym("x"), matrix.sym("m", operator.n_memory), matrix.sym("h")
    compiled = ca.Function(
        "f",
        [x, memory, h],
        [operator.value(CASADI, x, memory, h), ca.vertcat(*operator.advance(CASADI, x, memory, h))],
    )
    for seed in range(6):
        states, _ = wandered_memory(operator, seed)
        at = float(np.random.default_rng(seed).uniform(-5, 5))
        value, after = compiled(at, ca.DM(states), STEP)
        expected = float(operator.value(NUMPY, at, states, STEP))
        assert float(value) == pytest.approx(expected, rel=1e-12, abs=1e-12)
        np.testing.assert_allclose(
            np.array(after).ravel(),
            operator.advance(NUMPY, at, states, STEP),
            rtol=1e-12,
            atol=1e-12,
        )


@every
def test_sympy_agrees(operator: Any) -> None:
    x = sympy.Symbol("x", real=True)
    states, _ = wandered_memory(operator, 1)
    value = operator.value(SYMPY, x, states, STEP)
    after = operator.advance(SYMPY, x, states, STEP)
    for at in (-3.1, 0.4, 2.7):
        expected = float(operator.value(NUMPY, at, states, STEP))
        assert float(sympy.sympify(value).subs(x, at)) == pytest.approx(expected, rel=1e-11)
        np.testing.assert_allclose(
            [float(sympy.sympify(state).subs(x, at)) for state in after],
            operator.advance(NUMPY, at, states, STEP),
            rtol=1e-10,
            atol=1e-12,
        )


@every
def test_derivative_by_input(operator: Any) -> None:
    """CasADi's derivative is the difference quotient away from kinks."""
    x, memory = ca.SX.sym("x"), ca.SX.sym("m", operator.n_memory)
    output = operator.value(CASADI, x, memory, STEP)
    slope = ca.Function("s", [x, memory], [ca.jacobian(output, x)])
    h, checked = 1e-6, 0
    for seed in range(20):
        states, _ = wandered_memory(operator, seed)
        at = float(np.random.default_rng(seed).uniform(-5, 5))
        points = (operator.value(NUMPY, at + d, states, STEP) for d in (-h, 0.0, h))
        below, mid, above = map(float, points)
        if abs(above - 2 * mid + below) > 1e-12:
            continue
        quotient = (above - below) / (2 * h)
        assert float(slope(at, ca.DM(states))) == pytest.approx(quotient, rel=1e-7, abs=1e-12)
        checked += 1
    assert checked >= 10


@every
def test_linear_slope_is_the_slope_of_a_small_jump(operator: Any) -> None:
    memory = operator.advance(NUMPY, 0.0, operator.initial_memory(0.0))
    h = 1e-3
    quotient = (operator.value(NUMPY, h, memory) - operator.value(NUMPY, 0.0, memory)) / h
    assert float(quotient) == pytest.approx(operator.linear_slope, rel=1e-9)


@every
def test_memory_is_a_fixed_point_of_initial_memory(operator: Any) -> None:
    for seed in range(8):
        memory, x0 = wandered_memory(operator, seed)
        again = operator.initial_memory(x0, memory)
        np.testing.assert_allclose(again, memory, rtol=1e-12, atol=1e-12)


@every
def test_virgin_memory_is_a_straight_way_from_zero(operator: Any) -> None:
    straight = operator.advance(NUMPY, 3.0, operator.initial_memory(0.0))
    np.testing.assert_allclose(straight, operator.initial_memory(3.0), rtol=1e-15, atol=1e-15)


@invertible
def test_inverse_from_a_memory_with_a_past(operator: Any) -> None:
    for seed in range(12):
        memory, _ = wandered_memory(operator, seed)
        x = wander(seed + 7)
        z, after = operator.run(x, memory, step=STEP)
        before = inverse_memory_of(NUMPY, operator, memory)
        back, after_back = operator.inverse().run(z, before, step=STEP)
        np.testing.assert_allclose(back, x, rtol=0, atol=2e-12 * np.max(np.abs(x)))
        end = inverse_memory_of(NUMPY, operator, after)
        # a rate is a difference over the step, and rounding grows with it
        np.testing.assert_allclose(after_back, end, rtol=1e-9, atol=1e-10)


@invertible
def test_inverse_of_the_inverse(operator: Any) -> None:
    x = wander(4)
    again = operator.inverse().inverse()
    np.testing.assert_allclose(
        again.run(x, step=STEP)[0], operator.run(x, step=STEP)[0], atol=1e-11
    )


@every
def test_claims_hold(operator: Any) -> None:
    """Without time: a minor excursion leaves no trace; equal minor loops if congruent."""
    if operator.timed:
        assert not operator.wipes_out
        assert not operator.congruent
        return
    loops = []
    for seed in range(10):
        memory, _ = wandered_memory(operator, seed)
        minor = np.random.default_rng(seed).uniform(-1.0, 1.5, 10)
        _, plain = operator.run([-1.0, 1.5], memory)
        _, detour = operator.run([-1.0, 1.5, *minor, 1.5], memory)
        if operator.wipes_out:
            np.testing.assert_allclose(plain, detour, rtol=1e-14, atol=1e-14)
        up = np.linspace(-1, 1.5, 40)
        loops.append(np.ptp(operator.run([1.5, -1.0, *up, *up[::-1]], memory)[0][2:]))
    if operator.congruent:
        assert np.ptp(loops) < 1e-12


@every
def test_errors_name_the_culprit(operator: Any) -> None:
    with pytest.raises(BadInput, match=r"x\[2\] = nan"):
        operator.run([0.0, 1.0, np.nan], step=STEP)
    with pytest.raises(BadInput, match="x = nan"):
        operator.advance(NUMPY, float("nan"), operator.initial_memory(), STEP)
    with pytest.raises(BadMemory, match=f"has {operator.n_memory} memory states"):
        operator.value(NUMPY, 0.0, (0.0,) * (operator.n_memory + 1), STEP)
