"""Creep: exact steps, the logarithm, memory of sizes, work, and the inverses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bondgraph.hysteresis import (
    AlJanaideh,
    BadParameter,
    Inverse,
    MaxwellResistiveCapacitor,
    NotInvertible,
    PrandtlIshlinskii,
)
from bondgraph.hysteresis.creep.first_order_lag import ramp_rate, ramp_share, relaxed_share
from bondgraph.hysteresis.creep.hysteresis_with_creep import HysteresisWithCreep
from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep
from bondgraph.hysteresis.creep.log_creep import LogCreep
from bondgraph.support.ops import NUMPY
from tests.bondgraph.hysteresis.examples import wander

CREEP = LogCreep((30.0, 3.0, 0.3), (0.0, 0.5, 1.2), (0.1, 0.05, -0.02))
LINEAR = KelvinVoigtCreep(1.0, (0.3, 0.1, 0.2), (0.01, 0.1, 3.0))


def test_relaxation_keeps_its_digits() -> None:
    q = np.geomspace(1e-18, 500.0, 400)
    np.testing.assert_allclose(relaxed_share(NUMPY, q), -np.expm1(-q), rtol=1e-15)
    # reference in extended precision, where the difference has digits to spare
    far = q[q > 1e-3].astype(np.longdouble)
    reference = 1 + np.expm1(-far) / far
    np.testing.assert_allclose(ramp_share(NUMPY, q[q > 1e-3]), reference.astype(float), rtol=3e-14)
    small = q[q < 1e-3]
    series = small / 2 - small**2 / 6 + small**3 / 24 - small**4 / 120 + small**5 / 720
    np.testing.assert_allclose(ramp_share(NUMPY, small), series, rtol=1e-15)
    assert ramp_share(NUMPY, 0.0) == 0.0
    assert ramp_rate(NUMPY, 0.0) == 0.5


def test_log_creep_does_not_see_the_present_input() -> None:
    _, memory = CREEP.run(wander(1), step=0.1)
    trial = np.linspace(-50, 50, 7)
    output = CREEP.value(NUMPY, trial, memory, 0.1)
    assert output.shape == (7,)
    assert np.ptp(output) == 0.0
    assert CREEP.linear_slope == 0.0


@pytest.mark.parametrize("parts", [2, 3, 50])
def test_log_creep_steps_compose_while_the_input_is_held(parts: int) -> None:
    for seed in range(10):
        _, memory = CREEP.run(wander(seed), step=0.1)
        x = memory[0]
        whole = CREEP.advance(NUMPY, x, memory, 0.4)
        divided = memory
        for _ in range(parts):
            divided = CREEP.advance(NUMPY, x, divided, 0.4 / parts)
        np.testing.assert_allclose(divided, whole, rtol=1e-13, atol=1e-14)
        value = CREEP.value(NUMPY, 9.0, memory, 0.4)
        assert CREEP.value(NUMPY, 9.0, divided, 0.0) == pytest.approx(float(value), abs=1e-13)


def test_log_creep_solves_its_differential_equation() -> None:
    memory = (2.0, 0.0, 3.0, -1.0, 1.9, 2.2, 5.0, 0.0, 0.0, 4.0)
    a = np.tile(CREEP.eigenvalues, 3)
    r = np.repeat(CREEP.thresholds, 3)

    def rate(_t: float, y: Any) -> Any:
        return a * np.maximum(2.0 - y - r, np.minimum(2.0 - y + r, 0.0))

    found = solve_ivp(rate, (0, 0.7), memory[1:], rtol=1e-11, atol=1e-13, method="LSODA")
    after = CREEP.advance(NUMPY, 2.0, memory, 0.7)
    np.testing.assert_allclose(after[1:], found.y[:, -1], atol=1e-9)
    # states inside their slot rest: y_01.. of threshold 0 move, 1.9 and 2.2 do not
    assert after[4] == 1.9 or CREEP.thresholds[1] < abs(2.0 - 1.9)
    assert after[4:6] == (1.9, 2.2)


def test_log_creep_has_a_threshold() -> None:
    creep = LogCreep((1.0, 0.1), (2.0,), (1.0,))
    assert np.all(creep.run(np.full(50, 1.9), step=10.0)[0] == 0.0)
    assert creep.run(np.full(5000, 3.0), step=10.0)[0][-1] == pytest.approx(2 * (3.0 - 2.0))


@pytest.mark.parametrize(("per_decade", "ripple"), [(1, 0.12), (2, 0.003)])
def test_creep_grows_with_the_logarithm_of_time(per_decade: int, ripple: float) -> None:
    creep = LogCreep.over_decades(1e-3, 1e5, 0.01, per_decade=per_decade)
    assert len(creep.eigenvalues) == 8 * per_decade + 1
    _, memory = creep.run([1.0], creep.initial_memory(1.0), step=1e-9)
    t = np.geomspace(1.0, 1e2, 400)  # three decades from either end
    y = np.array([creep.value(NUMPY, 1.0, memory, float(at)) for at in t])
    slope = np.gradient(y, np.log10(t))[1:-1]
    print(f"{per_decade} a decade: slope within {np.max(np.abs(slope / 0.01 - 1)):.2%} of its mean")
    assert np.max(np.abs(slope / 0.01 - 1)) < ripple


def test_seven_kelvin_voigt_units_follow_five_decades() -> None:
    t = np.geomspace(1.0, 1e5, 600)
    times = np.logspace(-0.5, 5.5, 7)
    units = np.column_stack([np.ones(t.size), *(1 - np.exp(-t / tau) for tau in times)])
    gain, *weights = np.linalg.lstsq(units, np.log10(t) + 5.0, rcond=None)[0]
    creep = KelvinVoigtCreep(gain, tuple(weights), tuple(times))
    memory = creep.initial_memory(1.0)
    y = np.array([creep.value(NUMPY, 1.0, memory, float(at)) for at in t])
    error = float(np.max(np.abs(y - np.log10(t) - 5.0)) / 5.0)
    print(f"7 Kelvin-Voigt units over 5 decades: {error:.2%} of the creep")
    assert error < 0.0045


@pytest.mark.parametrize("parts", [2, 7])
def test_linear_creep_steps_compose_along_a_ramp(parts: int) -> None:
    for seed in range(10):
        _, memory = LINEAR.run(wander(seed), step=0.1)
        whole = LINEAR.advance(NUMPY, 3.0, memory, 0.2)
        divided = memory
        for x in np.linspace(memory[0], 3.0, parts + 1)[1:]:
            divided = LINEAR.advance(NUMPY, float(x), divided, 0.2 / parts)
        np.testing.assert_allclose(divided, whole, rtol=1e-13, atol=1e-14)


def test_linear_creep_solves_its_differential_equation() -> None:
    memory, tau = (1.0, 0.5, -2.0, 4.0), np.array(LINEAR.times)
    found = solve_ivp(
        lambda t, y: (1.0 + 2.0 * t / 0.3 - y) / tau, (0, 0.3), memory[1:], rtol=1e-11, atol=1e-13,
        method="Radau",
    )  # fmt: skip
    np.testing.assert_allclose(
        LINEAR.advance(NUMPY, 3.0, memory, 0.3)[1:], found.y[:, -1], atol=1e-9
    )


def test_linear_creep_is_linear() -> None:
    a, b = wander(1), wander(2)
    zero = LINEAR.initial_memory(0.0)
    together, _ = LINEAR.run(2 * a - 3 * b, zero, step=0.03)
    parts = 2 * LINEAR.run(a, zero, step=0.03)[0] - 3 * LINEAR.run(b, zero, step=0.03)[0]
    np.testing.assert_allclose(together, parts, atol=1e-12)


@pytest.mark.parametrize("step", [1e-7, 1e-3, 0.1, 10.0])
def test_linear_creep_stores_and_loses_its_work(step: float) -> None:
    rng = np.random.default_rng(0)
    for _ in range(10):
        memory, x = tuple(rng.uniform(-3, 3, 4).tolist()), float(rng.uniform(-3, 3))
        stored0 = LINEAR.stored_energy(NUMPY, memory[0], memory)
        stored = LINEAR.stored_energy(NUMPY, x, memory, step)
        lost = LINEAR.dissipated_energy(NUMPY, x, memory, step)
        # the same ramp as far as it has come, finer at its beginning
        part = np.linspace(0.0, 1.0, 20_001) ** 3
        way = memory[0] + part * (x - memory[0])
        y = LINEAR.value(NUMPY, way, memory, part * step)
        work = np.sum(0.5 * (way[1:] + way[:-1]) * np.diff(y))
        assert lost >= 0.0
        assert work == pytest.approx(stored - stored0 + lost, rel=1e-5, abs=1e-6)
    assert LINEAR.dissipated_energy(NUMPY, 2.0, memory) == 0.0


def test_linear_creep_never_gives_energy_around_a_cycle() -> None:
    for seed in range(10):
        x = np.append(wander(seed), 0.0)
        start = memory = LINEAR.initial_memory(0.0)
        balance = 0.0
        for value in x:
            balance += LINEAR.dissipated_energy(NUMPY, float(value), memory, 0.05)
            memory = LINEAR.advance(NUMPY, float(value), memory, 0.05)
        assert balance > 0.0
        assert start == (0.0,) * 4


@pytest.mark.parametrize("step", [1e-6, 1e-2, 1.0, 1e3])
def test_linear_creep_inverse(step: float) -> None:
    for weights in ((0.3, 0.1, 0.2), (-0.3, 0.5, -0.6)):
        creep = KelvinVoigtCreep(1.0, weights, (0.01, 0.1, 3.0))
        for seed in range(10):
            _, memory = creep.run(wander(seed), step=0.07)
            x = wander(seed + 50)
            y, after = creep.run(x, memory, step=step)
            back, after_back = creep.inverse().run(y, creep.inverse_memory(memory), step=step)
            assert np.max(np.abs(back - x)) < 5e-13 * 5.0
            np.testing.assert_allclose(after_back, after, atol=1e-12)


def test_linear_creep_inverse_names_the_offender() -> None:
    with pytest.raises(NotInvertible, match="gain = 0") as caught:
        KelvinVoigtCreep(0.0, (1.0,), (1.0,)).inverse()
    assert caught.value.index == 0
    creep = KelvinVoigtCreep(1.0, (0.5, -0.7, -0.6), (1.0, 2.0, 3.0))
    with pytest.raises(NotInvertible, match=r"weights\[2\] = -0\.6") as caught:
        creep.inverse()
    assert caught.value.index == 3
    fast = creep.inverse(step=0.1)  # the units follow too little of a short step to matter
    x = wander(3)
    y, _ = creep.run(x, step=0.1)
    assert np.max(np.abs(fast.run(y, creep.initial_memory(x[0]), step=0.1)[0] - x)) < 1e-11
    steep = KelvinVoigtCreep(0.1, (-0.7,), (1.0,))
    with pytest.raises(NotInvertible, match=r"at step = 5.0 s.*weights\[0\]"):
        steep.inverse(step=5.0)


MODELS = {
    "plays": HysteresisWithCreep(
        PrandtlIshlinskii((0.0, 0.3, 1.0, 2.5), (1.2, 0.6, -0.4, 0.9)), CREEP
    ),
    "envelope": HysteresisWithCreep(
        AlJanaideh(q=1.0, c=1.5, sigma=0.4, alpha=0.5, beta=0.3, count=6), CREEP
    ),
}


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())
@pytest.mark.parametrize("step", [1e-3, 0.2, 100.0])
def test_hysteresis_with_creep_is_inverted_without_an_equation(model: Any, step: float) -> None:
    worst = 0.0
    for seed in range(12):
        _, memory = model.run(wander(seed), step=0.1)
        x = wander(seed + 70, n=300)
        y, after = model.run(x, memory, step=step)
        back, after_back = model.inverse().run(y, model.inverse_memory(memory), step=step)
        worst = max(worst, float(np.max(np.abs(back - x)) / np.ptp(x)))
        np.testing.assert_allclose(after_back, after, atol=1e-11)
    print(f"hysteresis with creep, step {step} s: round trip {worst:.1e} of the range")
    assert worst < 1e-13


def test_creep_follows_a_held_input_and_its_inverse_holds_the_output() -> None:
    model = HysteresisWithCreep(
        PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5)), LogCreep.over_decades(0.1, 100.0, 0.02)
    )
    held, _ = model.run(np.full(10_000, 5.0), step=0.01)
    assert held[1000] - held[100] == pytest.approx(5 * 0.02, rel=0.12)  # from 1 s to 10 s
    drive, _ = model.inverse().run(np.full(10_000, 5.0), step=0.01)
    assert np.all(np.diff(drive) < 0)
    output, _ = model.run(drive, model.inverse().initial_memory(5.0), step=0.01)
    np.testing.assert_allclose(output, 5.0, atol=1e-12)


def test_given_states_are_moved_to_possible_ones() -> None:
    creep = LogCreep((1.0,), (0.0, 0.5), (1.0, 1.0))
    assert creep.initial_memory(0.0, (9.0, 2.0, -4.0)) == (0.0, 2.0, 1.5)
    # no history makes the states of one eigenvalue part further
    rng = np.random.default_rng(0)
    memory = creep.initial_memory(0.0)
    for _ in range(300):
        memory = creep.advance(NUMPY, float(rng.uniform(-9, 9)), memory, float(rng.uniform(0, 2)))
        assert abs(memory[1] - memory[2]) <= 0.5 + 1e-12


def test_errors_name_the_entry() -> None:
    with pytest.raises(BadParameter, match=r"eigenvalues\[1\] = 0\.0"):
        LogCreep((1.0, 0.0), (0.0,), (1.0,))
    with pytest.raises(BadParameter, match=r"thresholds\[0\] = -1\.0"):
        LogCreep((1.0,), (-1.0,), (1.0,))
    with pytest.raises(BadParameter, match="thresholds has 2 entries but weights has 1"):
        LogCreep((1.0,), (0.0, 1.0), (1.0,))
    with pytest.raises(BadParameter, match="eigenvalues is empty"):
        LogCreep((), (0.0,), (1.0,))
    with pytest.raises(BadParameter, match=r"slowest = 1\.0 s must be longer"):
        LogCreep.over_decades(2.0, 1.0, 0.1)
    with pytest.raises(BadParameter, match="per_decade = 0"):
        LogCreep.over_decades(1.0, 2.0, 0.1, per_decade=0)
    with pytest.raises(BadParameter, match=r"times\[0\] = 0\.0"):
        KelvinVoigtCreep(1.0, (1.0,), (0.0,))
    with pytest.raises(BadParameter, match="times is empty"):
        KelvinVoigtCreep(1.0, (), ())
    with pytest.raises(BadParameter, match="creep must be a LogCreep"):
        HysteresisWithCreep(MODELS["plays"].hysteresis, LINEAR)  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match="hysteresis must be an operator"):
        HysteresisWithCreep(1.0, CREEP)  # type: ignore[arg-type]
    with pytest.raises(BadParameter, match="forward must be an operator"):
        Inverse(CREEP)  # type: ignore[arg-type]
    with pytest.raises(NotInvertible, match="maxwell_resistive_capacitor has no exact inverse"):
        HysteresisWithCreep(MaxwellResistiveCapacitor((1.0,), (1.0,)), CREEP).inverse()
