"""The ultrasonic stage in motion: friction along the way, open loop, sampled position loop."""

from __future__ import annotations

from dataclasses import replace
from math import atan, degrees, inf, pi, radians

import casadi as ca
import numpy as np
import pytest

from actuators import ultrasonic as us
from actuators.ultrasonic.closed_loop import decision
from actuators.ultrasonic.sampled_loop import closed_loop_matrix, open_loop_response
from actuators.ultrasonic.stage import MOVED_MASS
from bondgraph import UnusableInput
from tests.settled import simulate

TAU = MOVED_MASS / us.M661.damping


def test_motion_is_that_of_the_language() -> None:
    time = np.arange(2001) * 1e-4
    volt = 1 + 5 * np.sin(2 * np.pi * 10 * time)
    graph = us.ultrasonic_stage(friction=0.25)
    run = simulate(graph, time, {"V_c": volt}, hold="hold", x0=np.zeros(2))
    x, v = us.move(us.Stage(friction=0.25, travel=1.0), np.array([0.5]), us.force(volt[:-1]), 1e-4)
    assert np.ptp(run["x"]) > 0.01
    assert np.abs(x[0] - 0.5 - run["x"]).max() < 2e-4 * np.ptp(run["x"])
    assert np.abs(v[0] - run["v"]).max() < 2e-3 * np.ptp(run["v"])
    assert np.any(run["v"][10:] == 0)  # it does stick


def test_sticks_below_the_level_and_slides_above() -> None:
    stage = us.Stage(friction=0.3)
    force = np.full(4000, 0.299)
    x, v = us.move(stage, np.array([0.001, 0.009]), force, 1e-4)
    assert np.ptp(x, axis=1).max() == 0.0
    x, v = us.move(stage, np.array([0.001]), np.full(400, 0.35), 1e-4)
    assert v[0, -1] == pytest.approx(0.05 / stage.damping, rel=1e-3)
    held = us.move(replace(stage, holding=2.0), np.array([0.001]), force + 1.0, 1e-4, np.ones(4000))
    assert np.ptp(held[0]) == 0.0


def test_end_stops_hold_until_pulled_back() -> None:
    force = np.concatenate([np.ones(2000), -np.ones(200)])
    x, v = us.move(us.Stage(), np.array([0.0, 0.010]), force, 1e-4)
    assert x.max() == us.M661.travel
    assert np.all(v[x == us.M661.travel] == 0)
    assert np.all(x[:, -1] < us.M661.travel - 1e-3)
    with pytest.raises(UnusableInput, match="outside of the travel"):
        us.move(us.Stage(), np.array([0.02]), force, 1e-4)
    with pytest.raises(UnusableInput, match="cannot be negative"):
        us.Stage(friction=-0.1)


def test_friction_takes_only_energy() -> None:
    """Work of the force = kinetic energy + damper + friction, friction over the position."""
    stage = us.guided_stage(4)
    h, n = 1e-5, 8000
    force = np.where(np.arange(n) * h < 0.03, 0.9, 0.2)
    x, v = us.move(stage, np.array([0.001]), force, h)
    work = float(np.sum(force * np.diff(x[0])))
    middle = 0.5 * (v[0, 1:] + v[0, :-1])
    damper = float(np.sum(stage.damping * middle**2) * h)
    taken = work - damper - 0.5 * stage.mass * v[0, -1] ** 2
    assert not isinstance(stage.friction, float)
    levels = np.interp(x[0], stage.friction.knots, stage.friction.values)
    slid = float(np.sum(0.5 * (levels[1:] + levels[:-1]) * np.abs(np.diff(x[0]))))
    assert taken == pytest.approx(slid, rel=5e-3)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_slow_motion_gets_stuck_and_fast_motion_arrives(seed: int) -> None:
    slow, fast = (us.constant_voltage(v, seed=seed) for v in (3.0, 10.0))
    assert 0 < slow.not_started < 0.5
    assert slow.not_started + slow.stuck == 1.0
    assert slow.arrived == 0.0
    assert slow.spread > 1e-3
    assert fast.arrived == 1.0
    assert fast.spread < 1e-9
    shove = [us.constant_voltage(v, seed=seed, duration=0.02) for v in (3.0, 10.0)]
    assert shove[0].relative_spread > 5 * shove[1].relative_spread


def test_motion_is_mirrored_with_the_voltage() -> None:
    stage = us.Stage(friction=0.1)
    driver = us.Driver(1e-4, 1e4, 1e4)
    up, down = (
        us.constant_voltage(v, stage=stage, driver=driver, duration=0.01, starts=1.0)
        for v in (4.0, -4.0)
    )
    free = (up.position.max(axis=1) < 0.0179) & (down.position.min(axis=1) > 1e-4)
    assert free.sum() > 20
    np.testing.assert_allclose(up.moved[free], -down.moved[free], atol=1e-12)


def test_what_becomes_of_a_run_is_told_of_the_end_it_is_driven_to() -> None:
    down = us.constant_voltage(-10.0, runs=8, duration=0.3)
    assert down.final.max() == 0.0
    assert (down.arrived, down.stuck) == (1.0, 0.0)
    assert 0.0 < down.relative_spread < 2.0
    slow = us.constant_voltage(-3.0, runs=8, duration=0.3)
    assert slow.arrived < 0.5
    assert slow.stuck > 0.2


def test_lowest_sure_voltage_moves_everywhere() -> None:
    stage = us.guided_stage(0)
    sure = us.lowest_sure_voltage(stage)
    assert us.constant_voltage(sure + 0.05, stage=stage, duration=1.0).arrived == 1.0
    assert us.constant_voltage(sure - 0.25, stage=stage, duration=1.0).arrived < 1.0
    assert us.speed_at_sure_voltage(stage) > 0.1  # m/s: nothing slower is sure


def test_the_law_of_the_controller_is_the_one_it_states() -> None:
    c = us.PositionController(100.0, 0.05, 2e-3, breakaway=0.01)
    sampling = us.Sampling(1000.0)
    decide, reference = decision(ca, c, sampling), 1e-4
    before, last = 0.0, 0.0
    for x in (0.0, 3e-6, 7e-6, 8e-6):
        e, period = reference - x, 1 / sampling.rate
        stated = c.gain * (e + before - c.derivative * (x - last) / period) + 0.01
        force, before, last = (float(v) for v in decide(x, before, last, reference))
        assert force == pytest.approx(stated, rel=1e-6)
    errors = [reference - x for x in (0.0, 3e-6, 7e-6, 8e-6)]
    assert before == pytest.approx(period / c.integral * sum(errors), rel=1e-3)


# -- the position loop -----------------------------------------------------------------------
def rule_margin(loop: us.SampledLoop, crossover: float, rate: float) -> float:
    """Phase margin (degrees) by the rule of thumb: the sampled loop is late by ``(1/2 + d) T``."""
    w, c = 2 * pi * crossover, loop.controller
    controller = atan(w * c.derivative - 1 / (w * c.integral))
    late = w * (0.5 + loop.delay) / rate
    return degrees(pi / 2 - atan(w * loop.time_constant) + controller - late)


@pytest.mark.parametrize(("crossover", "derivative"), [(2, 0.0), (10, 0.0), (20, TAU), (50, TAU)])
def test_two_ways_to_the_stability_limit(crossover: float, derivative: float) -> None:
    """Nyquist's margin vanishes where a pole leaves the unit circle."""
    loop = us.designed(crossover, derivative=derivative)
    rate = us.stability_rate(loop)
    assert us.spectral_radius(loop, rate) == pytest.approx(1.0, abs=1e-5)
    assert abs(us.phase_margin(loop, rate)) < 0.3
    assert us.spectral_radius(loop, 1.1 * rate) < 1 < us.spectral_radius(loop, 0.9 * rate)
    good = us.margin_rate(loop)
    assert good > rate
    assert us.phase_margin(loop, good) == pytest.approx(45.0, abs=1e-3)


@pytest.mark.parametrize(("present", "limit"), [(False, 75.0), (True, 81.1)])
def test_the_present_error_in_the_integral_costs_samples(present: bool, limit: float) -> None:
    """Poles from the polynomial of the loop, with either sum in it."""
    loop = us.designed(10.0)
    rate = us.stability_rate(loop, present=present)
    assert rate == pytest.approx(limit, abs=0.05)
    T, tau, c = 1 / rate, loop.time_constant, loop.controller
    phi = np.exp(-T / tau)
    g = (T - tau * (1 - phi)) / loop.damping, (1 - phi) / loop.damping
    plant = np.polyadd(g[0] * np.poly([phi]), [tau * (1 - phi) * g[1]])
    share = T / c.integral
    control = np.polyadd([1.0, -1.0], [share, 0.0] if present else [share])
    closed = np.polyadd(np.poly([0.0, 1.0, 1.0, phi]), c.gain * np.polymul(control, plant))
    assert np.abs(np.roots(closed)).max() == pytest.approx(1.0, abs=1e-5)


def test_exact_margin_tends_to_the_rule_of_thumb() -> None:
    loop = us.designed(10.0)
    for rate in (500.0, 2000.0, 10_000.0):
        rule = rule_margin(loop, 10.0, rate)
        assert us.phase_margin(loop, rate) == pytest.approx(rule, abs=100.0 / rate)
    rest = radians(rule_margin(loop, 10.0, inf) - 45.0)
    assert us.margin_rate(loop) == pytest.approx(2 * pi * 10.0 * 1.5 / rest, rel=0.05)
    assert abs(open_loop_response(loop, 1e5, np.array([10.0]))[0]) == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("delay", [0, 1, 2, 3])
def test_poles_are_zeros_of_one_plus_loop_gain(delay: int) -> None:
    loop = us.designed(10.0, derivative=TAU, delay=delay)
    rate = 300.0
    f = np.array([3.0, 11.0, 60.0])
    z = np.exp(2j * np.pi * f / rate)
    n = 4 + delay
    characteristic = np.array(
        [np.linalg.det(v * np.eye(n) - closed_loop_matrix(loop, rate)) for v in z]
    )
    phi = np.exp(-1 / (rate * loop.time_constant))
    opened = z ** (1 + delay) * (z - 1) ** 2 * (z - phi)
    np.testing.assert_allclose(
        characteristic / opened, 1 + open_loop_response(loop, rate, f), rtol=1e-8
    )


def test_more_delay_needs_more_samples() -> None:
    rates = [us.stability_rate(us.designed(10.0, derivative=TAU, delay=d)) for d in (0, 1, 2)]
    assert rates[0] < rates[1] < rates[2]
    assert rule_margin(us.designed(50.0), 50.0, inf) < 45.0
    with pytest.raises(UnusableInput, match="no sample rate"):
        us.margin_rate(us.designed(50.0))


@pytest.mark.parametrize(("crossover", "derivative"), [(10.0, 0.0), (20.0, TAU)])
def test_nonlinear_loop_is_stable_above_the_computed_rate_only(
    crossover: float, derivative: float
) -> None:
    loop = us.designed(crossover, derivative=derivative)
    limit = us.stability_rate(loop)

    def swing(factor: float) -> us.Answer:
        way = us.Sampling(factor * limit)
        return us.step_answer(loop.controller, way, step=2e-4, duration=60 / crossover)

    assert swing(0.9).swing > 1e-3  # a limit cycle over millimetres
    assert swing(1.2).swing < 2e-8  # some steps of the 1 nm reading
    good = us.step_answer(loop.controller, us.Sampling(us.margin_rate(loop)), step=2e-4)
    assert good.overshoot < 0.35
    assert good.error < 2e-8
    assert good.settling_time() < 4 / crossover
    assert swing(0.9).settling_time() == float("inf")


def test_dry_friction_makes_the_swing_fall_with_the_rate() -> None:
    loop = us.designed(20.0, derivative=TAU)
    kick = replace(loop.controller, breakaway=0.5)
    stage = us.guided_stage(0, holding=us.M661.holding_force)
    swings = [
        us.step_answer(kick, us.Sampling(r), stage=stage, step=2e-3, duration=0.6).swing
        for r in (100.0, 1e3, 5e3)
    ]
    assert swings[0] > 5e-3
    assert swings[0] > 4 * swings[1] > 12 * swings[2] > 0
    calm = us.step_answer(
        kick, us.Sampling(5e3, tolerance=1e-5), stage=stage, step=2e-3, duration=0.6
    )
    assert calm.swing == 0.0
    assert calm.error < 2e-5
    # without the push over the friction it does not move at all
    weak = us.step_answer(us.PositionController(100.0), us.Sampling(5e3), stage=stage, step=2e-4)
    assert weak.error == pytest.approx(2e-4, rel=1e-3)


def test_loop_refusals() -> None:
    with pytest.raises(UnusableInput, match="no step within"):
        us.step_answer(us.PositionController(1.0), us.Sampling(100.0), step=1.0)
    with pytest.raises(UnusableInput, match="rate"):
        us.Sampling(0.0)
    with pytest.raises(UnusableInput, match="gain and integral"):
        us.PositionController(-1.0)
    with pytest.raises(UnusableInput, match="delay"):
        us.SampledLoop(us.PositionController(1.0), delay=-1)


def test_a_tick_of_the_bench_is_one_of_the_simulated_loop() -> None:
    rate = 500.0
    c = us.PositionController(200.0, integral=0.05, derivative=2e-3)
    loop = us.StageLoop(c, us.Sampling(rate))
    loop.begin(1e-3, 0.0)
    # by hand: K (e - T_d dx / T), the sum holds only errors before this one
    for x, r, force in ((1.2e-3, 2e-3, 200 * (8e-4 - 2e-3 * rate * 2e-4)),
                        (1.2e-3, 2e-3, 200 * (8e-4 + 8e-4 / rate / 0.05))):  # fmt: skip
        volts = loop.decide(x, r)
        assert us.force(volts) == pytest.approx(force, rel=1e-4)
        loop.applied(volts)
    before = loop.decide(1.2e-3, 2e-3)
    loop.applied(0.0)  # held back: the sum stands
    assert loop.decide(1.2e-3, 2e-3) == pytest.approx(before)
