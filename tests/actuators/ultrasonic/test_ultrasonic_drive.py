"""The drive side of the ultrasonic actuator: data sheet, characteristic, driver, wires, plate."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest

from actuators import ultrasonic as us
from actuators.ultrasonic.driver import build_up_time
from bondgraph import UnusableInput
from bondgraph.equations.derivation import equations
from tests.settled import simulate

SHEET = us.M661


def test_data_sheet_agrees_with_a_sine_and_with_the_supply() -> None:
    assert round(SHEET.sine_rms) == SHEET.voltage_rms
    assert SHEET.supply_power == pytest.approx(SHEET.power, rel=0.05)
    # as a current through the plate the printed 400 mA would be far more than 5 W
    assert SHEET.sine_rms * SHEET.current > 3 * SHEET.power
    y = 1 / SHEET.load_resistance + 2j * pi * SHEET.frequency * SHEET.largest_capacitance
    assert abs(y) * SHEET.sine_rms == pytest.approx(SHEET.current, rel=1e-12)
    assert SHEET.largest_output < 0.05 * SHEET.power


def test_characteristic_has_the_three_facts() -> None:
    volts = np.linspace(-10, 10, 2001)
    f = us.force(volts)
    assert np.all(f[np.abs(volts) <= 2] == 0)
    assert np.all(f[volts > 2.001] > 0)
    assert np.abs(f).max() == SHEET.push_force
    np.testing.assert_allclose(f[volts >= 6], SHEET.push_force, rtol=1e-12)
    assert f[volts < 5.99].max() < SHEET.push_force
    np.testing.assert_allclose(f, -us.force(-volts), atol=1e-15)
    # quick after the dead zone, slow towards the maximum
    assert us.force(3.0) > us.force(6.0) - us.force(4.0)


def test_inverse_characteristic() -> None:
    wanted = np.array([-1.0, -0.3, -1e-9, 0.0, 1e-9, 0.1, 0.72, 0.999])
    volts = us.control_voltage(wanted)
    np.testing.assert_allclose(us.force(volts), wanted, atol=1e-12)
    assert volts[3] == 0.0
    assert abs(volts[2]) >= 2.0
    assert us.control_voltage(5.0) == pytest.approx(6.0)
    assert us.control_voltage(2.0, largest=5.0) == pytest.approx(3.0)
    with pytest.raises(UnusableInput, match="largest force"):
        us.voltage_force(0.0)


def test_bond_graph_settles_at_force_over_damping_either_way() -> None:
    time = np.arange(801) * 1e-4
    speeds = {}
    for volt in (-10.0, -3.0, -1.9, 1.9, 3.0, 4.5, 10.0):
        command = {"V_c": np.full(time.size, volt)}
        run = simulate(us.ultrasonic_stage(), time, command, x0=np.zeros(2))
        speeds[volt] = run["v"]
        assert run["v"][-1] == pytest.approx(float(us.force(volt)) / SHEET.damping, abs=1e-6)
    np.testing.assert_allclose(speeds[-3.0], -speeds[3.0], atol=1e-12)
    assert speeds[10.0][-1] == pytest.approx(SHEET.max_velocity, rel=1e-6)


def test_bond_graph_balances_its_power() -> None:
    """Work of the drive = kinetic energy + damper + friction."""
    time = np.arange(20001) * 1e-5
    volt = 6 * np.sin(2 * pi * 20 * time)
    graph = us.ultrasonic_stage(friction=0.2)
    run = simulate(graph, time, {"V_c": volt}, x0=np.zeros(2), observed=("e_V_c", "e_b"))
    v = run["v"]

    def integral(power: np.ndarray) -> float:
        return float(np.sum(0.5 * (power[1:] + power[:-1])) * 1e-5)

    given, lost = integral(run["e_V_c"] * v), integral(run["e_b"] * v)
    stored = 0.5 * graph.parameters["m"].value * v[-1] ** 2
    assert given == pytest.approx(lost + stored, rel=2e-3)
    assert np.all(run["e_b"] * v >= -1e-9)


def test_bond_graph_with_lag_and_its_states() -> None:
    space = equations(us.ultrasonic_stage(lag=build_up_time(), sensors=("x",)))
    assert set(space.states) == {"z_V_c", "p_m", "q_x"}
    time = np.arange(4001) * 1e-6
    command = {"V_c": np.full(time.size, 10.0)}
    run = simulate(
        us.ultrasonic_stage(lag=1e-3), time, command, x0=np.zeros(3), observed=("e_V_c",)
    )
    np.testing.assert_allclose(run["e_V_c"], 1 - np.exp(-time / 1e-3), atol=1e-6)


def _simulated_settling(start: float, end: float) -> float:
    time = np.arange(4001) * 1e-6
    a = us.envelope(time, np.where(time < 2e-6, start, end))
    return float(time[np.flatnonzero(np.abs(a - end) > 0.05 * abs(end - start))[-1]]) - 2e-6


def test_driver_has_the_two_facts_of_the_step_responses() -> None:
    small, large = _simulated_settling(-4, 4), _simulated_settling(-9, 9)
    assert large / small == pytest.approx(2.0, abs=0.01)
    assert _simulated_settling(9, -9) - large == pytest.approx(0.1e-3, abs=3e-6)
    d = us.fitted_driver()
    assert d.settling_time(-9, 9) == pytest.approx(large, abs=3e-6)
    assert d.settling_time(4, -4) > d.settling_time(-4, 4)


def test_driver_limits_and_refusals() -> None:
    lag, quick = us.Driver(1e-3, 1e9, 1e9), 1e-3 * np.log(20)
    assert lag.settling_time(-9, 9) == pytest.approx(quick)
    assert lag.settling_time(-4, 4) == pytest.approx(quick)
    slew = us.Driver(1e-12, 1e3, 2e3)
    assert slew.settling_time(-9, 9) / slew.settling_time(-4, 4) == pytest.approx(2.25)
    assert slew.settling_time(-4, 4) / slew.settling_time(4, -4) == pytest.approx(2.0)
    for ratio in (1.2, 1.6, 2.1):
        d = us.fitted_driver(2e-4, ratio=ratio, longer=0.0)
        assert d.settling_time(-9, 9) / d.settling_time(-4, 4) == pytest.approx(ratio, rel=1e-6)
        assert d.upward == pytest.approx(d.downward, rel=1e-6)
    with pytest.raises(UnusableInput, match=r"between 1 and 2\.25"):
        us.fitted_driver(ratio=2.5)
    with pytest.raises(UnusableInput, match="> 0"):
        us.Driver(0.0, 1.0, 1.0)
    with pytest.raises(UnusableInput, match="two equal rows"):
        us.envelope(np.arange(3.0), np.zeros(4))


def test_envelope_does_not_depend_on_the_step_and_keeps_to_the_slew() -> None:
    d = us.fitted_driver()
    coarse = np.arange(41) * 1e-4
    fine = np.arange(4001) * 1e-6
    a = us.envelope(coarse, np.where(coarse < 1.5e-3, 9.0, -9.0), d)
    b = us.envelope(fine, np.where(fine < 1.4995e-3, 9.0, -9.0), d)
    np.testing.assert_allclose(a, b[::100], atol=1e-9)
    rate = np.diff(b) / 1e-6
    assert rate.min() >= -d.downward * (1 + 1e-9)
    assert us.envelope(coarse, np.full(41, 25.0)).max() == 10.0


def _cycles(volt: float, n: int = 20, **options: object) -> us.ThreeWire:
    step = 1 / (SHEET.frequency * 64)
    time = np.arange(64 * n) * step
    return us.three_wire(time, np.full(time.size, volt), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("balance", [0.0, 0.3, 0.5, 1.0])
def test_three_wires(balance: float) -> None:
    electrodes = us.Electrodes(balance=balance)
    w = _cycles(10.0, electrodes=electrodes)
    assert np.ptp(w.active) == pytest.approx(SHEET.voltage_peak_to_peak, rel=1e-3)
    assert np.sqrt(np.mean(w.active**2)) == pytest.approx(SHEET.sine_rms, rel=1e-9)
    np.testing.assert_allclose(w.positive - w.back, w.active, atol=1e-12)
    # the floating electrode carries no charge away
    c = electrodes
    ground = w.passive + w.back
    charge = c.front * w.passive + c.mutual * (ground - w.positive) + c.stray * ground
    assert np.abs(charge).max() < 1e-12 * c.front * 60
    assert np.abs(w.passive).max() < 0.2 * np.abs(w.active).max()
    half = _cycles(5.0, electrodes=electrodes)
    np.testing.assert_allclose(half.active, 0.5 * w.active, atol=1e-12)


def test_roles_change_with_the_sign() -> None:
    up, down = _cycles(8.0), _cycles(-8.0)
    np.testing.assert_allclose(up.positive, down.negative, atol=1e-12)
    np.testing.assert_allclose(up.negative, down.positive, atol=1e-12)
    np.testing.assert_allclose(up.back, down.back, atol=1e-12)
    assert np.abs(_cycles(0.0).active).max() == 0.0
    with pytest.raises(UnusableInput, match="too coarse"):
        us.three_wire(np.arange(10) * 1e-5, np.ones(10))
    with pytest.raises(UnusableInput, match="no share"):
        us.Electrodes(balance=1.5)


def test_plate_takes_the_printed_power_and_stays_within_the_current() -> None:
    plate = us.Plate()
    y = complex(plate.admittance(SHEET.frequency))
    assert SHEET.sine_rms**2 * y.real == pytest.approx(SHEET.power, rel=1e-9)
    assert SHEET.sine_rms * abs(y) < SHEET.current
    # half power half a width away
    edge = plate.admittance(SHEET.frequency + plate.half_width / (2 * pi))
    assert float(np.real(edge)) == pytest.approx(0.5 * y.real, rel=1e-2)
    with pytest.raises(UnusableInput, match="> 0"):
        us.Plate(quality=0.0)


def test_plate_as_a_bond_graph_delivers_the_power_of_the_phasors() -> None:
    """Full carrier: steady current, mean power, and the build-up that the driver's lag assumes."""
    plate, f, per = us.Plate(), SHEET.frequency, 256
    time = np.arange(per * 320) / (per * f)
    volt = SHEET.amplitude * np.sin(2 * pi * f * time)
    run = simulate(us.plate_graph(plate, output=0.1), time, {"V": volt}, x0=np.zeros(3))
    last = slice(-per, None)
    # the current of C_0 is constant within a step, so the work takes the mean voltage of the step
    middle = 0.5 * (volt[1:] + volt[:-1])
    power = float(np.mean(middle[last] * run["i"][last]))
    assert power == pytest.approx(SHEET.power, rel=2e-3)
    expected = SHEET.sine_rms * abs(complex(plate.admittance(f)))
    assert sqrt(float(np.mean(run["i"][last] ** 2))) == pytest.approx(expected, rel=1e-2)
    amplitude = np.abs(run["i_m"]).reshape(-1, per).max(axis=1)
    at = round(build_up_time() * f)
    share = 1 - np.exp(-(at + 0.5) / (build_up_time() * f))
    assert amplitude[at] / amplitude[-1] == pytest.approx(share, abs=0.02)
