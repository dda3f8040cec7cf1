"""Resonance tracking: baseband against carrier, heating, lock range, and what is lost without."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from actuators import ultrasonic as us
from bondgraph import UnusableInput
from tests.settled import simulate

COLD = us.Heating(resistance=0.0)


def test_baseband_is_the_envelope_of_the_carrier() -> None:
    """Build-up at a detuned drive: beats of the bond graph's vibration at 64 samples a period."""
    plate, off = us.Plate(quality=60.0), 4e3
    f = plate.frequency + off
    step = 1 / (64 * f)
    time = np.arange(64 * 200) * step
    # as the cosine of the phasor with the voltage as reference
    volt = us.M661.amplitude * np.cos(2 * pi * f * time)
    carrier = simulate(us.plate_graph(plate, output=1e-2), time, {"V": volt}, x0=np.zeros(3))
    turns = np.exp(-2j * pi * f * time)
    phasor = 2 * (carrier["i_m"] * turns).reshape(-1, 64).mean(axis=1)
    base = us.run_plate(plate, COLD, detuning=off, duration=200 / f, step=1 / f)
    share = np.abs(phasor) * plate.resistance / us.M661.amplitude
    middle = 0.5 * (base.amplitude[1:] + base.amplitude[:-1])
    assert np.abs(share - middle).max() < 0.02
    assert np.abs(base.amplitude).max() > 1.05 * base.amplitude[-1]  # it does beat
    assert np.angle(phasor[-1]) == pytest.approx(base.phase[-1], abs=0.02)


@pytest.mark.parametrize("off", [-3e3, -500.0, 0.0, 500.0, 3e3])
def test_steady_state_is_that_of_the_circuit(off: float) -> None:
    plate = us.Plate()
    end = us.run_plate(plate, COLD, detuning=off, duration=0.05)
    motional = (
        plate.admittance(plate.frequency + off)
        - 2j * pi * (plate.frequency + off) * plate.capacitance
    )
    assert end.amplitude[-1] == pytest.approx(abs(motional) * plate.resistance, rel=2e-2)
    assert end.phase[-1] == pytest.approx(np.angle(motional), abs=0.02)
    volt = us.M661.amplitude
    assert end.power[-1] == pytest.approx(0.5 * volt**2 * float(np.real(motional)), rel=3e-2)


@pytest.mark.parametrize("quality", [100.0, 350.0, 1000.0])
def test_heating_detunes_a_fixed_drive_to_its_equilibrium(quality: float) -> None:
    plate, heating = us.Plate(quality=quality), us.Heating(time_constant=2.0)
    free = us.run_plate(plate, heating, duration=30.0)
    expected = us.warm_detuning(plate, heating)
    assert free.detuning[-1] == pytest.approx(expected, rel=1e-4)
    # what is dissipated is what the temperature carries off
    assert free.warming[-1] == pytest.approx(heating.resistance * free.power[-1], rel=1e-4)
    x = expected / (plate.half_width / (2 * pi))
    assert free.amplitude[-1] == pytest.approx(1 / np.hypot(1, x), rel=1e-4)


@pytest.mark.parametrize("quality", [100.0, 1000.0])
def test_loop_keeps_the_phase_at_zero_while_the_plate_warms(quality: float) -> None:
    plate, heating = us.Plate(quality=quality), us.Heating(time_constant=2.0)
    free = us.run_plate(plate, heating, duration=30.0)
    locked = us.run_plate(plate, heating, us.PhaseLock(), duration=30.0)
    assert abs(locked.phase[-1]) < 1e-6
    assert np.abs(locked.phase[500:]).max() < 0.15
    assert locked.amplitude[-1] == pytest.approx(1.0, abs=1e-9)
    assert locked.power[-1] == pytest.approx(us.M661.power, rel=1e-6)
    assert locked.warming[-1] == pytest.approx(30.0, rel=1e-4)
    assert free.amplitude[-1] < locked.amplitude[-1] - 0.1
    low = [
        us.run_plate(plate, heating, k, control=5.0, duration=30.0) for k in (None, us.PhaseLock())
    ]
    assert low[1].force[-1] == pytest.approx(float(us.force(5.0)), rel=1e-6)
    assert low[0].force[-1] < low[1].force[-1]


def test_a_negative_control_voltage_turns_the_force_alone() -> None:
    up, down = (
        us.run_plate(us.Plate(), COLD, us.PhaseLock(), control=c, detuning=200.0, duration=0.5)
        for c in (10.0, -10.0)
    )
    assert abs(down.detuning[-1]) < 1.0
    np.testing.assert_array_equal(down.amplitude, up.amplitude)
    np.testing.assert_array_equal(down.power, up.power)
    np.testing.assert_allclose(down.force, -up.force)


def test_lag_behind_a_drift_is_rate_over_bandwidth() -> None:
    """An integrating loop follows a ramp late by the ramp over its bandwidth."""
    plate, heating = us.Plate(), us.Heating(time_constant=200.0)
    lock = us.PhaseLock(bandwidth=4.0)
    r = us.run_plate(plate, heating, lock, duration=4.0)
    drift = -heating.coefficient * plate.frequency * heating.resistance * us.M661.power / 200.0
    assert r.detuning[2000] == pytest.approx(drift * np.exp(-2 / 200) / (2 * pi * 4.0), rel=2e-2)


@pytest.mark.parametrize("start", [-9e3, -2e3, 2e3, 9e3])
def test_compensated_loop_returns_from_its_whole_span(start: float) -> None:
    r = us.run_plate(us.Plate(), COLD, us.PhaseLock(), detuning=start, duration=4.0)
    assert abs(r.detuning[-1]) < 1e-6
    assert abs(r.phase[-1]) < 1e-8
    shaken = us.run_plate(
        us.Plate(), COLD, us.PhaseLock(proportional=0.2), detuning=start, duration=4.0
    )
    assert abs(shaken.detuning[-1]) < 1e-6


@pytest.mark.parametrize("share", [0.5, 0.8, 0.9])
def test_residual_capacitance_limits_the_lock_range(share: float) -> None:
    plate = us.Plate()
    found = us.zero_phase(plate, share)
    assert found is not None
    rest, edge = found
    for f in found:  # both are zeros of the whole current's phase, in the narrow-band circuit
        x = 2 * pi * f / plate.half_width
        y = 1 / plate.resistance / (1 + 1j * x) + 1j * plate.susceptance * (1 - share)
        assert abs(y.imag) < 1e-12 * abs(y) + 1e-18
    lock = us.PhaseLock(compensation=share, span=30e3)
    inside, outside = (
        us.run_plate(plate, COLD, lock, detuning=k * edge, duration=20.0) for k in (0.97, 1.03)
    )
    assert inside.detuning[-1] == pytest.approx(rest, rel=1e-6)
    assert outside.detuning[-1] == pytest.approx(lock.span)
    assert outside.amplitude[-1] < 0.1


def test_without_compensation_there_may_be_no_zero_phase() -> None:
    plate = us.Plate()
    assert us.zero_phase(plate, 0.0) is None
    assert plate.susceptance * plate.resistance > 0.5
    assert us.zero_phase(us.Plate(capacitance=0.5e-9), 0.0) is not None
    assert us.zero_phase(plate, 1.0) == (0.0, float("inf"))
    # the exact admittance agrees: its phase stays positive everywhere
    f = np.linspace(205e3, 225e3, 4001)
    assert np.angle(plate.admittance(f)).min() > 0
    assert np.angle(us.Plate(capacitance=0.5e-9).admittance(f)).min() < 0


def test_refusals() -> None:
    with pytest.raises(UnusableInput, match="too long for a loop"):
        us.run_plate(lock=us.PhaseLock(bandwidth=100.0))
    with pytest.raises(UnusableInput, match="control 0 V drives nothing"):
        us.run_plate(control=0.0)
    with pytest.raises(UnusableInput, match="bandwidth"):
        us.PhaseLock(bandwidth=0.0)
    with pytest.raises(UnusableInput, match="time constant"):
        us.Heating(time_constant=0.0)
