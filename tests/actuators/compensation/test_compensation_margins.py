"""Margins against known loops, against poles and against the loop in time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from actuators.compensation import (
    OPEN,
    ControlLoop,
    ProportionalIntegral,
    SampledPlant,
    VirtualActuator,
    actuator_like,
    choose_gains,
    linear_operator,
    margins,
    pole_radius,
    run_loop,
)
from bondgraph.hysteresis import AlJanaideh
from bondgraph.support.errors import UnusableInput

RATE = 20_000.0
NOMINAL = actuator_like(AlJanaideh.stack_2hz())
LINEAR = VirtualActuator(1.5e-6, (), ())


def sampled(actuator: VirtualActuator, slipping: bool, delay: int = 0) -> SampledPlant:
    """The small-signal plant with gain 1 and `delay` more samples of delay."""
    a, b = actuator.linear_model(slipping=slipping)
    plant = SampledPlant.from_continuous(a, b, np.eye(b.size)[1], 1.0 / RATE)
    plant = plant.scaled(1.0 / plant.static_gain)
    for _ in range(delay):
        n = plant.b.size
        wide = np.zeros((n + 1, n + 1))
        wide[:n, :n], wide[n, :n] = plant.a, plant.c
        plant = SampledPlant(wide, np.append(plant.b, 0.0), np.eye(n + 1)[n], plant.step)
    return plant


PLANTS = [sampled(NOMINAL, s) for s in (True, False)]
GAINS = choose_gains(PLANTS)


def test_margins_of_an_integrator_behind_a_delay() -> None:
    """``K / (z (z - 1))`` is stable for K < 1, and its phase is known."""
    plant = SampledPlant(np.zeros((1, 1)), np.ones(1), np.ones(1), 1.0)
    m = margins(plant, ProportionalIntegral(0.0, 0.2))
    assert m.gain == pytest.approx(5.0, rel=2e-3)
    omega = 2.0 * math.asin(0.1)
    assert 2.0 * math.pi * m.crossover == pytest.approx(omega, rel=1e-4)
    assert m.phase == pytest.approx(math.degrees(math.pi / 2 - 1.5 * omega), rel=1e-3)
    assert m.delay == pytest.approx((math.pi / 2 - 1.5 * omega) / omega, rel=1e-3)
    assert m.radius == pytest.approx((1.0 + math.sqrt(0.2)) / 2.0, rel=1e-9)
    with pytest.raises(UnusableInput, match="both gains"):
        margins(plant, OPEN)


@pytest.mark.parametrize("slipping", [True, False])
@pytest.mark.parametrize("ratio", [0.0, 2e-5])
def test_margins_are_where_the_poles_leave_the_circle(slipping: bool, ratio: float) -> None:
    plant = sampled(NOMINAL, slipping)
    shape = ProportionalIntegral(ratio * 500.0, 500.0)
    m = margins(plant, shape)

    def radius(plant: SampledPlant, factor: float = 1.0) -> float:
        scaled = ProportionalIntegral(factor * shape.proportional, factor * shape.integral)
        return pole_radius(plant, scaled)

    assert radius(plant, 0.98 * m.gain) < 1.0 < radius(plant, 1.02 * m.gain)
    samples = m.delay * RATE
    assert radius(sampled(NOMINAL, slipping, math.floor(samples))) < 1.0
    assert radius(sampled(NOMINAL, slipping, math.ceil(samples))) > 1.0


def test_chosen_gains_keep_the_margins_and_are_not_timid() -> None:
    found = [margins(p, GAINS) for p in PLANTS]
    assert all(m.gain >= 2.0 and m.phase >= 60.0 and m.radius < 1.0 for m in found)
    limiting = max(max(1.0 / m.gain, m.resonance) for m in found)
    assert limiting == pytest.approx(0.5, rel=5e-3)
    careful = choose_gains(PLANTS, gain=4.0)
    assert careful.integral == pytest.approx(0.5 * GAINS.integral, rel=0.1)
    with pytest.raises(UnusableInput, match="no gains keep"):
        choose_gains(PLANTS, phase=95.0)


def test_the_loop_in_time_agrees_with_the_margin() -> None:
    """Below the gain margin a step settles, above it grows until the limits hold it."""
    plant = sampled(LINEAR, True)
    m = margins(plant, GAINS)
    wanted = np.full(3000, 2e-6)
    spread = []
    for factor in (0.9, 1.1):
        scaled = ProportionalIntegral(
            factor * m.gain * GAINS.proportional, factor * m.gain * GAINS.integral
        )
        loop = ControlLoop(linear_operator(LINEAR.capacitance * LINEAR.transducer), scaled)
        spread.append(np.ptp(run_loop(loop, LINEAR, wanted).x[-300:]))
    assert spread[0] < 1e-9
    assert spread[1] > 1e-6
