"""PI behind an inverse: the recursion by hand, and what an envelope does to it."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.compensation import (
    UNIPOLAR,
    ControlLoop,
    ProportionalIntegral,
    actuator_like,
    run_loop,
)
from bondgraph.hysteresis import AlJanaideh, Ang, PrandtlIshlinskii
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import NUMPY
from hardware.regulation import InverseLoop

GAIN = 50e-9
LINEAR = PrandtlIshlinskii((0.0,), (GAIN,))
RATE = 1000.0


def test_a_gain_is_the_textbook_recursion() -> None:
    kp, ki = 0.2, 250.0
    loop = InverseLoop(LINEAR, kp, ki, RATE)
    rng = np.random.default_rng(1)
    total = 0.0
    loop.begin(0.0, 0.0)
    for r, x in rng.normal(0.0, 1e-6, (20, 2)):
        e = r - x
        total += ki / RATE * e
        expected = (kp * e + total + r) / GAIN
        asked = loop.decide(x, r)
        loop.applied(asked)
        assert asked == pytest.approx(expected, rel=1e-12)


def test_what_is_held_back_is_taken_from_the_sum() -> None:
    kp, ki = 0.5, 250.0
    loop = InverseLoop(LINEAR, kp, ki, RATE, feedforward=False)
    loop.begin(0.0, 0.0)
    # e = 8 um: the sum is 2 um, the command 6 um or 120 V, of which 100 V are applied
    assert loop.decide(0.0, 8e-6) == pytest.approx(120.0)
    loop.applied(100.0)
    # 1 um too much, taken back with ki T / kp = 1/2
    assert loop.decide(0.0, 0.0) == pytest.approx((2e-6 - 0.5e-6) / GAIN)


def test_the_memory_is_that_of_the_voltage_that_was_applied() -> None:
    actuator = Ang.stack_2hz()
    loop = InverseLoop(actuator, 0.0, 0.0, RATE)
    memory = actuator.initial_memory(0.0)
    loop.begin(0.0, 0.0)
    t = np.arange(400) / 400.0
    wanted = 3.2e-6 * (1.0 - np.cos(2.0 * np.pi * 2.0 * t))  # beyond 100 V at its top
    error, held = [], []
    for r in wanted:
        asked = loop.decide(0.0, r)
        volts = min(max(asked, 0.0), 100.0)
        loop.applied(volts)
        run, memory = actuator.run([volts], memory)
        error.append(float(run[0]) - r)
        held.append(volts != asked)
    clipped = np.array(held)
    assert 50 < clipped.sum() < 250
    # between the two stretches at 100 V too, where a memory gone astray would show
    assert clipped[:200].any()
    assert clipped[200:].any()
    assert np.abs(np.array(error)[~clipped]).max() < 1e-15


def test_it_is_the_controller_of_the_simulated_loop() -> None:
    model = Ang.stack_2hz()
    actuator = actuator_like(AlJanaideh.stack_2hz())
    rate, gains = 2e3, ProportionalIntegral(0.1, 400.0)
    simulated = ControlLoop(model, gains, False, UNIPOLAR, rate)
    # beyond what 100 V reach, so that limits and unwinding are in it
    wanted = 3e-6 * (1.0 - np.cos(2.0 * np.pi * 10.0 * np.arange(300) / rate))
    run = run_loop(simulated, actuator, wanted)
    assert run.clipped.any()
    assert not run.clipped.all()
    loop = InverseLoop(model, gains.proportional, gains.integral, rate, feedforward=False)
    loop.begin(float(model.value(NUMPY, 0.0, model.initial_memory(0.0))), 0.0)
    volts, x, r = [], 0.0, 0.0
    for k in range(wanted.size):
        # the simulated loop acts on what it read a sample ago
        asked = loop.decide(x, r)
        volts.append(min(max(asked, UNIPOLAR.low), UNIPOLAR.high))
        loop.applied(volts[-1])
        x, r = float(run.x[k]), float(wanted[k])
    np.testing.assert_allclose(volts, run.voltage, atol=1e-9)


def test_it_starts_where_the_actuator_rests() -> None:
    loop = InverseLoop(Ang.stack_2hz(), 0.0, 100.0, RATE)
    loop.begin(7e-7, 30.0)
    assert loop.decide(7e-7, 7e-7) == pytest.approx(30.0)
    loop.begin(0.0, 30.0)
    assert loop.decide(0.0, 0.0) == pytest.approx(30.0)


@pytest.mark.parametrize(("kp", "ki"), [(0.0, 2000.0), (1.0, 100.0), (0.9, 300.0)])
def test_gains_that_no_actuator_stands_are_refused(kp: float, ki: float) -> None:
    poles = np.roots([1.0, kp + ki / RATE - 1.0, -kp])
    assert np.abs(poles).max() >= 1.0 - 1e-9
    with pytest.raises(UnusableInput, match="not stable"):
        InverseLoop(LINEAR, kp, ki, RATE)
    assert np.abs(np.roots([1.0, 0.9 * (kp + ki / RATE) - 1.0, -0.9 * kp])).max() < 1.0
    InverseLoop(LINEAR, 0.9 * kp, 0.9 * ki, RATE)


def test_an_operator_without_an_inverse_has_no_loop() -> None:
    falling = PrandtlIshlinskii((0.0, 1.0), (1.0, -2.0))
    with pytest.raises(ValueError, match="no inverse"):
        InverseLoop(falling, 0.0, 1.0, RATE)
