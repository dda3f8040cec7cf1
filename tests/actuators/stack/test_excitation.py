"""Erasing a memory: the printed signal's numbers, the bound of what is left, the limits."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.stack.excitation import (
    demagnetisation,
    join,
    loading_ramp,
    possible_biases,
    printed_demagnetisation,
    residual_bound,
    residual_states,
    sine,
)
from actuators.stack.voltage_limits import P840_1
from bondgraph.hysteresis import AlJanaideh, PrandtlIshlinskii, turning_points
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.errors import UnusableInput

STACK = AlJanaideh.stack_2hz()
PLAYS = STACK.as_prandtl_ishlinskii()


def test_printed_signal_and_what_it_leaves() -> None:
    signal = printed_demagnetisation()
    assert signal.time[-1] == pytest.approx(2.67, abs=1e-3)
    assert signal.volt.min() == pytest.approx(-16.9, abs=0.05)
    assert signal.volt.max() == pytest.approx(19.0, abs=0.05)
    loop, memory = STACK.run([0.0, 100.0, 0.0])
    assert loop[-1] == pytest.approx(507e-9, abs=0.5e-9)
    left = STACK.run(np.append(signal.volt, 0.0), memory)[0][-1]
    assert left == pytest.approx(132e-9, abs=0.5e-9)


def test_no_decay_within_the_limits_erases_around_zero() -> None:
    """A voltage of -20 V leaves at least sum w max(r - 20 V, 0)."""
    r, w = np.array(PLAYS.thresholds, float), np.array(PLAYS.weights, float)
    least = float(w @ np.maximum(r - 20.0, 0.0))
    signal = demagnetisation(PLAYS.thresholds, 0.0, partial=True)
    assert signal.volt.min() >= -20.0
    left = STACK.run(np.concatenate(([0.0, 100.0, 0.0], signal.volt)))[0][-1]
    assert least < left < 1.05 * least
    assert least > 90e-9


@pytest.mark.parametrize("seed", range(25))
def test_bound_holds_for_every_play_after_any_history(seed: int) -> None:
    rng = np.random.default_rng(seed)
    r = np.concatenate(([0.0], np.cumsum(rng.uniform(0.5, 6.0, 8))))
    w = rng.normal(size=r.size)
    bias = float(rng.uniform(-10, 10))
    step = float(rng.uniform(0.1, 4.0))
    amplitude = float(r[-1] + step * rng.uniform(-3.0, 3.0) + 4.0)
    room = DriveLimits(bias - amplitude, bias + amplitude)
    signal = demagnetisation(r[1:].tolist(), bias, step=step, limits=room, partial=True)
    used = float(signal.volt[turning_points(signal.volt)][1] - bias)
    # the step is a whole part of the amplitude, so a little smaller than asked for
    real = used / np.ceil(used / step * (1 - 1e-12))
    history = rng.uniform(bias - 80, bias + 80, 30)
    history[-1] = 0.0
    operator = PrandtlIshlinskii(tuple(r.tolist()), tuple(w.tolist()))
    output, states = operator.run(np.concatenate((history, signal.volt)))
    off = np.abs(np.array(states, float) - bias)
    assert np.all(off <= residual_states(r[1:], used, real) + 1e-9)
    rest = operator.run([bias], memory=(bias,) * operator.n_memory)[0][0]
    assert abs(output[-1] - rest) <= residual_bound(r, w, used, real) + 1e-9


def test_bound_is_reached_by_the_worst_play() -> None:
    """A play whose slot closes half way between two turning points is off by half a step."""
    signal = demagnetisation([10.0], 30.0, step=1.0)
    turns = signal.volt[turning_points(signal.volt)] - 30.0
    used, real = turns[1], turns[1] + turns[2]
    r = np.linspace(0.5 * real, used - 0.5 * real, 400)
    operator = PrandtlIshlinskii((0.0, *r.tolist()), (0.0, *([1.0] * r.size)))
    states = np.array(operator.run(signal.volt)[1], float)
    assert np.abs(states - 30.0).max() == pytest.approx(0.5 * real, rel=0.02)
    assert residual_states(r, used, real).max() == pytest.approx(0.5 * real)


def test_smaller_steps_leave_less() -> None:
    def left(step: float) -> float:
        signal = demagnetisation(PLAYS.thresholds, 50.0, step=step)
        after = PLAYS.run(np.concatenate(([0.0, 100.0, 0.0], signal.volt)))[0][-1]
        return abs(float(after - PLAYS.run([50.0], memory=(50.0,) * 10)[0][0]))

    coarse, fine = left(2.0), left(0.2)
    assert fine < 0.25 * coarse
    assert fine < 3e-9


def test_turning_points_are_samples_and_the_start_is_met() -> None:
    signal = demagnetisation([0.0, 5.0, 10.0], 40.0, step=0.5, start=7.0, rate=1000.0)
    assert signal.volt[0] == 7.0
    assert signal.volt.max() == pytest.approx(40.0 + 10.25)
    assert signal.volt[-1] == pytest.approx(40.0)
    turns = signal.volt[turning_points(signal.volt)][1:] - 40.0
    assert np.all(np.diff(np.abs(turns)) < 0)
    assert np.all(turns[:-2] * turns[1:-1] < 0)
    assert np.abs(np.diff(np.abs(turns))).max() <= 0.5 + 1e-12


def test_limits_say_which_bias_is_possible() -> None:
    with pytest.raises(UnusableInput, match=r"around 0 V .* bias of 23\.\d+ \.\. 76\.\d+ V"):
        demagnetisation(PLAYS.thresholds, 0.0)
    with pytest.raises(UnusableInput, match="no bias has room"):
        demagnetisation([80.0], 50.0)
    assert possible_biases(43.6) == pytest.approx((23.6, 76.4))
    assert possible_biases(71.0) is None


def test_current_limit_counts_the_capacitance() -> None:
    small = DriveLimits(-20.0, 120.0, current=1e-4, capacitance=1.5e-6)
    with pytest.raises(UnusableInput, match=r"mA, more than 0\.1 mA; be .* times slower"):
        demagnetisation(PLAYS.thresholds, 50.0, limits=small)
    slow = demagnetisation(PLAYS.thresholds, 50.0, frequency=0.2, limits=small)
    assert np.abs(np.diff(slow.volt)).max() * slow.rate * 1.5e-6 <= 1e-4
    # peak current of a sine, pi f C U_pp: 100 Hz, 100 V, 1.5 uF
    wave = sine(100.0, 0.1, rate=1e5)
    peak = np.abs(np.diff(wave.volt)).max() * wave.rate * 1.5e-6
    assert peak == pytest.approx(47e-3, rel=0.01)
    P840_1.check(wave.time, wave.volt, "sine")


@pytest.mark.parametrize(
    ("thresholds", "more", "match"),
    [
        ([], {}, "thresholds"),
        ([0.0], {}, "thresholds"),
        ([-1.0, 2.0], {}, "thresholds"),
        ([float("nan")], {}, "thresholds"),
        ([5.0], {"step": 0.0}, "step"),
        ([5.0], {"frequency": 1000.0}, "lower the frequency"),
    ],
)
def test_refusals(thresholds: list[float], more: dict[str, float], match: str) -> None:
    with pytest.raises(UnusableInput, match=match):
        demagnetisation(thresholds, 50.0, **more)  # type: ignore[arg-type]


def test_limits_refuse_nonsense() -> None:
    with pytest.raises(UnusableInput, match="no room"):
        DriveLimits(10.0, 10.0)
    with pytest.raises(UnusableInput, match="positive"):
        DriveLimits(current=0.0)


def test_ramp_and_join() -> None:
    ramp = loading_ramp()
    assert ramp.volt.size == 31251
    assert (ramp.volt[0], ramp.volt[-1], ramp.time[-1]) == (0.0, 100.0, 10.0)
    both = join(printed_demagnetisation(), ramp)
    assert both.volt.size == printed_demagnetisation().volt.size + ramp.volt.size - 1
    assert np.allclose(np.diff(both.time), 1 / 3125)
    with pytest.raises(UnusableInput, match="begins -50 V off"):
        join(ramp, loading_ramp(50.0, 60.0))
    with pytest.raises(UnusableInput, match="samples/s"):
        join(ramp, loading_ramp(100.0, 0.0, rate=1000.0))
    with pytest.raises(UnusableInput, match="at least one"):
        join()
    with pytest.raises(UnusableInput, match="no step"):
        loading_ramp(duration=0.0)
