"""Amplifier numbers, calibration, the output behind a card, the ultrasonic driver."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bondgraph.support.errors import UnusableInput
from hardware.contracts import RawOutput
from hardware.devices.amplifier import (
    EPA_104,
    Amplifier,
    AnalogueAmplifier,
    EndedWave,
    Monitors,
    UltrasonicDriver,
    UltrasonicLimits,
)
from hardware.devices.daq import Card, CardChannel, CardInputs, SoftwareTimedWave
from hardware.envelope import P840_1_UNIPOLAR, Envelope, GuardedOutput
from hardware.errors import LimitViolation, LinkLost, ProtocolFault, TimedOut
from hardware.simulators.registers import AmplifierData, CardFront, Wires
from hardware.simulators.registers.model import WRITE16, WRITE32
from hardware.simulators.rig import Rig
from tests.hardware.devices.daq.bench import Capacitor, card_on

STACK = Amplifier(gain=20.0, monitors=Monitors(voltage=0.05, current=50.0))


def bench(data: AmplifierData | None = None) -> tuple[Rig, CardFront, Card]:
    rig = Rig(Capacitor())
    front = CardFront(rig, amplifier=data, wires=Wires(noise=0.0))
    return rig, front, card_on(front, rig)


def amplifier_on(card: Card, data: Amplifier = STACK, **kept: bool) -> AnalogueAmplifier:
    return AnalogueAmplifier(
        CardChannel(card, 0), data, CardInputs(card, (0, 1)), clock=card.clock, **kept
    )


def test_the_stack_is_kept_within_its_range_by_a_converter_of_five_volts() -> None:
    assert EPA_104.input_volts(100.0) == pytest.approx(5.0)
    assert "memory" in EPA_104.source
    assert EPA_104.u_gain == math.inf
    for volts in (100.1, -0.1, math.nan, math.inf):
        with pytest.raises(LimitViolation):
            EPA_104.input_volts(volts)


@given(st.floats(0.0, 100.0), st.floats(1.0, 30.0), st.floats(-1.0, 1.0))
def test_there_and_back(volts: float, gain: float, offset: float) -> None:
    a = Amplifier(gain=gain, offset=offset)
    back = a.output_record(a.input_record(np.array([volts])))
    assert back[0] == pytest.approx(volts, abs=1e-9)


@pytest.mark.parametrize(
    "wrong",
    [{"gain": 0.0}, {"gain": math.nan}, {"offset": math.inf}, {"lowest": 5.0}, {"slew": 0.0}],
)
def test_an_amplifier_that_is_none_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(UnusableInput):
        replace(STACK, **wrong)  # type: ignore[arg-type]
    with pytest.raises(UnusableInput):
        Monitors(voltage=0.0)
    with pytest.raises(UnusableInput, match="no monitor"):
        Monitors(voltage=0.1).scaled("i", np.zeros(1))


def test_it_is_a_raw_output_that_says_it_has_no_watchdog() -> None:
    rig, front, card = bench()
    output = amplifier_on(card)
    assert isinstance(output, RawOutput)
    assert not output.has_watchdog
    output.power_up()
    output.write(80.0)
    rig.wait(1e-3)
    assert output.read() == pytest.approx(80.0, abs=0.03)
    assert output.read_current() == pytest.approx(0.0, abs=1e-4)
    assert "MF634" in output.identity.model
    assert (output.converter.v_min, output.converter.v_max) == (0.0, 100.0)
    assert output.converter.resolution == pytest.approx(20.0 * 20.0 / 16384)
    assert output.provenance()["monitor_current"] == 50.0
    assert output.provenance()["converter"] == "MF634"
    output.close()
    assert rig.volts == pytest.approx(80.0, abs=0.02)
    front.faults.gone = True
    output.close()


def test_a_saturating_converter_narrows_the_limits() -> None:
    _, _, card = bench()
    output = amplifier_on(card, Amplifier(gain=5.0, highest=100.0))
    assert output.amplifier.highest == 50.0
    output.power_up()
    with pytest.raises(LimitViolation, match="0 to 50 V"):
        output.write(51.0)


def test_clamping_is_opt_in_and_counted_and_never_takes_nan() -> None:
    rig, _, card = bench()
    output = amplifier_on(card, clamp=True)
    output.power_up()
    output.write(130.0)
    assert rig.volts == pytest.approx(100.0)
    output.write(-5.0)
    assert rig.volts == 0.0
    assert output.clamped == 2
    with pytest.raises(LimitViolation):
        output.write(math.nan)
    with pytest.raises(LimitViolation):
        amplifier_on(card).write(130.0)


def test_a_voltage_left_by_an_earlier_program_is_ramped_down_first() -> None:
    rig, front, card = bench()
    first = amplifier_on(card)
    first.power_up()
    for volts in np.arange(0.0, 81.0, 1.0):
        first.write(float(volts))
    first.close()
    assert rig.volts == pytest.approx(80.0, abs=0.02)
    again = amplifier_on(card_on(front, rig))
    again.power_up()
    assert rig.volts == 0.0
    assert rig.extremes.largest_step < 1.1
    assert rig.now == pytest.approx(0.8, abs=0.02)


def test_without_its_inputs_the_card_is_ramped_down_from_what_was_written_last() -> None:
    rig, front, card = bench()
    output = amplifier_on(card)
    output.power_up()
    for volts in np.arange(0.0, 61.0, 1.0):
        output.write(float(volts))
    front.faults.endless = True
    with pytest.raises(TimedOut):
        output.read()
    output.power_up()
    assert rig.volts == 0.0
    assert rig.extremes.largest_step < 1.1


class Floating:
    """Inputs that nothing is wired to."""

    def __init__(self, volts: float) -> None:
        self.volts = volts

    def read(self) -> np.ndarray:
        return np.array([self.volts, 0.0])


WIDE = replace(STACK, lowest=-200.0, highest=200.0)
"""As a station makes it: limits of the voltage are the envelope's business."""


def test_a_monitor_that_tells_what_cannot_be_is_not_walked_from() -> None:
    rig, front, card = bench()
    card.power_up()  # by an earlier program
    card = card_on(front, rig)
    raw = AnalogueAmplifier(CardChannel(card), WIDE, Floating(10.0), clock=card.clock)
    output = GuardedOutput(raw, P840_1_UNIPOLAR, card.clock)
    with pytest.raises(ProtocolFault, match=r"tells 200 V, outside the 0 \.\. 100 V") as refusal:
        output.power_up()
    assert "\n" not in str(refusal.value)
    assert rig.extremes.highest == 0.0


def test_the_last_command_counts_more_than_a_monitor() -> None:
    rig, _, card = bench()
    output = AnalogueAmplifier(CardChannel(card), WIDE, Floating(4.0), clock=card.clock)
    output.power_up()
    with pytest.raises(LimitViolation):
        output.write(201.0)
    for volts in range(11):
        output.write(float(volts))
    output.power_up()
    assert rig.volts == 0.0
    assert rig.extremes.highest == pytest.approx(10.0, abs=0.02)
    assert rig.extremes.largest_step < 1.1


def test_an_offset_is_taken_away_at_power_up() -> None:
    rig, _, card = bench(AmplifierData(offset=1.5))
    output = amplifier_on(card, replace(STACK, offset=1.5))
    output.power_up()
    assert rig.volts == pytest.approx(0.0, abs=0.02)


SLOW = Envelope(
    -20.0, 90.0, slew=100.0, i_max=1e-3, capacitance=1e-6, gentle=50.0, update_period=1e-3
)
"""Allows steps of 0.1 V."""


def offset_by(volts: float) -> tuple[Rig, CardFront, AnalogueAmplifier]:
    rig, front, card = bench(AmplifierData(gain=6.0, offset=volts))
    a = Amplifier(gain=6.0, offset=volts, lowest=-60.0, highest=90.0)
    return rig, front, AnalogueAmplifier(CardChannel(card), a, clock=card.clock)


def steps_within(rig: Rig, front: CardFront, allowed: float, begin: int = 0) -> None:
    """What the card wrote to its output while it was on, in volts at the actuator."""
    sent = [e for e in list(front.log)[begin:] if e.kind == WRITE16 and e.offset == 0x20]
    volts = np.array([6.0 * (e.value - 0x2000) * 20.0 / 16384 for e in sent])
    assert np.abs(np.diff(volts)).max() <= allowed + 6.0 * 20.0 / 16384
    assert np.diff([e.instant for e in sent])[1:].min() >= SLOW.update_period - 1e-9
    assert rig.volts == pytest.approx(0.0, abs=0.01)


def test_the_way_to_rest_keeps_slew_and_current_of_the_envelope() -> None:
    rig, front, raw = offset_by(40.0)
    output = GuardedOutput(raw, SLOW, raw._clock, probe=0.0)
    assert rig.volts == 40.0
    output.power_up()
    steps_within(rig, front, 0.1)
    assert rig.extremes.lowest > -0.01
    output.ramp(20.0)
    # an output that is on is neither switched off nor set to the offset in between
    begin = len(front.log)
    raw.power_up()
    steps_within(rig, front, 0.1, begin)
    assert not [e for e in list(front.log)[begin:] if e.kind == WRITE32]
    assert rig.extremes.highest == 40.0


def test_an_offset_that_the_actuator_does_not_stand_is_refused() -> None:
    _, front, raw = offset_by(40.0)
    with pytest.raises(UnusableInput, match="its offset puts 40 V on the actuator"):
        GuardedOutput(raw, Envelope(-20.0, 30.0, 100.0))
    assert not front.log


def test_a_voltage_that_was_left_is_ramped_down_at_the_pace_of_the_envelope() -> None:
    rig, front, card = bench()
    card.power_up()
    card.set_line(0, True)
    for volts in np.arange(0.0, 4.01, 0.005):
        card.write(0, float(volts))
    card = card_on(front, rig)
    raw = AnalogueAmplifier(CardChannel(card), WIDE, CardInputs(card, (0, 1)), clock=card.clock)
    GuardedOutput(raw, SLOW, card.clock, probe=0.0).power_up()
    assert rig.volts == 0.0
    assert rig.extremes.largest_step <= 0.1 + 0.04
    # what an earlier program had raised would hide the next edge
    lines = [e.value for e in front.log if e.kind == WRITE16 and e.offset == 0x10]
    assert lines[-1] == 0


def test_the_ultrasonic_driver_keeps_its_input_and_the_ends_of_travel() -> None:
    rig, front, card = bench(AmplifierData(gain=1.0, lowest=-10.0, highest=10.0))
    limits = UltrasonicLimits(largest=8.0, supply=5, lower_end=0, upper_end=1)
    driver = UltrasonicDriver(CardChannel(card), limits, card)
    assert isinstance(driver, RawOutput)
    assert not driver.has_watchdog
    driver.power_up()
    assert card.lines == 1 << 5
    driver.write(-6.0)
    assert rig.volts == pytest.approx(-6.0, abs=1e-3)
    assert (driver.converter.v_min, driver.converter.v_max) == (-8.0, 8.0)
    wave = SoftwareTimedWave(card, driver.amplifier)
    with pytest.raises(LimitViolation, match="C-184"):
        wave.load(np.array([0.0, 9.0]), 100.0)
    driver.write(0.0)
    wave.load(np.array([0.0, -2.0, -6.0]), 100.0)
    list(wave.play())
    front.registers.lines_in = 0b01
    assert not driver.check_ends()
    assert driver.check_ends(-6.0)
    assert rig.volts == 0.0
    front.registers.lines_in = 0b00
    driver.write(-6.0)
    front.registers.lines_in = 0b01
    assert driver.check_ends()
    assert rig.volts == 0.0
    with pytest.raises(LimitViolation, match="lower end"):
        driver.write(-1.0)
    driver.write(2.0)
    assert not driver.check_ends()
    front.registers.lines_in = 0b10
    with pytest.raises(LimitViolation, match="upper end"):
        driver.write(3.0)
    assert rig.volts == 0.0
    for volts in (8.1, math.nan):
        with pytest.raises(LimitViolation, match="C-184"):
            driver.write(volts)
    driver.write(-8.0)
    driver.close()
    assert rig.volts == 0.0
    assert card.lines == 0
    assert driver.read() is None


def test_a_wave_that_a_switch_has_ended_stands_at_none_of_its_samples() -> None:
    rig, front, card = bench(AmplifierData(gain=1.0, lowest=-10.0, highest=10.0))
    driver = UltrasonicDriver(CardChannel(card), UltrasonicLimits(upper_end=1), card)
    driver.power_up()
    wave = EndedWave(SoftwareTimedWave(card, driver.amplifier), driver)
    wave.load(np.linspace(0.0, 5.0, 100), 1e3)
    front.registers.lines_in = 0b10
    with pytest.raises(LimitViolation, match="end of travel"):
        list(wave.play())
    assert rig.volts == 0.0
    assert wave.position is None
    front.registers.lines_in = 0
    assert list(wave.play())[-1].samples == wave.position == 100


def test_the_supply_of_the_ultrasonic_driver_is_off_while_its_input_is_unknown() -> None:
    _, front, card = bench()
    driver = UltrasonicDriver(CardChannel(card), UltrasonicLimits(supply=5), card)
    driver.power_up()
    supply = [e.value >> 5 & 1 for e in front.log if e.offset == 0x10 and e.bar == 2]
    zeroed = next(n for n, e in enumerate(front.log) if e.offset == 0x20 and e.value == 0x2000)
    first_on = next(n for n, e in enumerate(front.log) if e.offset == 0x10 and e.value >> 5 & 1)
    assert supply[-1] == 1
    assert zeroed < first_on
    front.faults.gone = True
    with pytest.raises(LinkLost):
        driver.power_up()
    driver.close()
    with pytest.raises(LimitViolation, match="largest amplitude"):
        UltrasonicLimits(largest=12.0)
    with pytest.raises(LimitViolation, match="no lines"):
        UltrasonicDriver(CardChannel(card), UltrasonicLimits(supply=1))
