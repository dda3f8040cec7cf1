"""The card by its registers: order at power-up, conversions, a card that is gone."""

from __future__ import annotations

import signal

import numpy as np
import pytest

from hardware.devices.daq import Access, AccessKind, SocketRegisters
from hardware.errors import HardwareError, LimitViolation, LinkLost, ProtocolFault, TimedOut
from hardware.simulators.registers import AmplifierData, CardFront, Wires
from hardware.simulators.registers.model import WRITE16, WRITE32
from hardware.simulators.rig import Rig
from tests.hardware.devices.daq.bench import Capacitor, card_on

MODELS = ("MF624", "MF634")
ENABLE = 1 << 26


def bench(model: str = "MF634", **kept: object) -> tuple[Rig, CardFront]:
    rig = Rig(Capacitor())
    return rig, CardFront(rig, model=model, **kept)  # type: ignore[arg-type]


@pytest.mark.parametrize("model", MODELS)
def test_the_hazard_is_real_enabling_first_drives_the_stack_to_the_amplifiers_end(
    model: str,
) -> None:
    rig, front = bench(model)
    bar, control = front.registers.CONTROL[model]
    front.registers.write32(bar, control, ENABLE)
    front.registers.write16(2, 0x20, 0x2000)
    assert rig.extremes.highest == pytest.approx(200.0, abs=0.05)


@pytest.mark.parametrize("model", MODELS)
def test_power_up_writes_zero_to_every_output_before_it_enables(model: str) -> None:
    rig, front = bench(model)
    card = card_on(front, rig)
    card.power_up()
    writes = [e for e in front.log if e.kind in (WRITE16, WRITE32)]
    enabling = next(n for n, e in enumerate(writes) if e.kind == WRITE32 and e.value & ENABLE)
    zeroed = {e.offset for e in writes[:enabling] if e.kind == WRITE16 and e.value == 0x2000}
    assert zeroed == {0x20 + 2 * n for n in range(8)}
    assert (rig.extremes.lowest, rig.extremes.highest) == (0.0, 0.0)
    assert card.enabled()
    assert set(front.registers.terminals) == {0.0}


def test_power_up_is_safe_after_a_program_that_left_held_values_behind() -> None:
    rig, front = bench()
    front.registers.write32(3, 0x68, 1 << 23)
    front.registers.write16(2, 0x20, 0x3FFF)
    card_on(front, rig).power_up()
    assert rig.extremes.highest == 0.0


def test_nothing_is_written_before_power_up() -> None:
    rig, front = bench()
    card = card_on(front, rig)
    with pytest.raises(ProtocolFault, match="power_up"):
        card.write(0, 1.0)
    assert not front.log


@pytest.mark.parametrize("volts", [float("nan"), float("inf"), 10.1, -11.0])
def test_what_the_converter_cannot_give_never_reaches_it(volts: float) -> None:
    rig, front = bench()
    card = card_on(front, rig)
    card.power_up()
    before = len(front.log)
    with pytest.raises(LimitViolation):
        card.write(0, volts)
    assert len(front.log) == before


def test_a_written_voltage_arrives_amplified_and_the_monitors_show_it() -> None:
    rig, front = bench(wires=Wires(noise=0.0))
    card = card_on(front, rig)
    card.power_up()
    got = card.write(0, 2.5)
    assert got == 2.5
    assert rig.volts == pytest.approx(50.0)
    rig.wait(1e-3)
    assert card.convert([0])[0] == pytest.approx(2.5, abs=1e-9)


def test_inputs_come_back_in_the_order_they_were_asked_for() -> None:
    rig, front = bench(wires=Wires(voltage=5, current=2, noise=0.0))
    card = card_on(front, rig)
    card.power_up()
    card.write(0, 1.0)
    rig.wait(1e-3)
    five, two = card.convert([5, 2])
    assert (five, two) == (pytest.approx(1.0, abs=1e-3), pytest.approx(0.0, abs=2e-3))
    assert card.convert([2, 5])[1] == five


@pytest.mark.parametrize("wanted", [[], [8], [-1], [1, 1]])
def test_inputs_that_do_not_exist_are_refused(wanted: list[int]) -> None:
    rig, front = bench()
    with pytest.raises(HardwareError, match="choose different ones"):
        card_on(front, rig).convert(wanted)


def test_a_conversion_that_takes_its_time_is_waited_for() -> None:
    rig, front = bench(wires=Wires(noise=0.0))
    front.faults.looks = 70
    card = card_on(front, rig)
    card.power_up()
    assert card.convert([0])[0] == 0.0


def test_a_conversion_that_never_ends_times_out() -> None:
    rig, front = bench()
    card = card_on(front, rig)
    card.power_up()
    front.faults.endless = True
    with pytest.raises(TimedOut, match="did not end"):
        card.convert([0])
    assert rig.now < 1.0


def test_a_card_that_is_gone_is_a_lost_link_and_has_to_be_powered_up_anew() -> None:
    rig, front = bench()
    card = card_on(front, rig)
    card.power_up()
    front.faults.gone = True
    for use in (lambda: card.convert([0]), card.enabled, card.power_up, card.read_lines):
        with pytest.raises(LinkLost, match="gone"):
            use()
    front.faults.gone = False
    with pytest.raises(ProtocolFault, match="power_up"):
        card.write(0, 1.0)


def test_outputs_that_another_program_holds_or_switches_off_are_noticed_at_once() -> None:
    rig, front = bench()
    card = card_on(front, rig)
    for word in (0, 1 << 23 | ENABLE):
        card.power_up()
        card.write(0, 1.0)
        front.registers.write32(3, 0x68, word)
        with pytest.raises(LinkLost, match="from outside"):
            card.write(0, 2.0)
        with pytest.raises(ProtocolFault, match="power_up"):
            card.write(0, 2.0)


def test_a_card_that_was_reset_cannot_be_adopted_but_powered_up() -> None:
    rig, front = bench()
    card = card_on(front, rig)
    card.power_up()
    assert card.adopt()
    front.registers.power_cycle()
    assert not card.adopt()
    card.power_up()
    assert rig.extremes.highest == 0.0


def test_digital_lines() -> None:
    rig, front = bench()
    card = card_on(front, rig)
    card.power_up()
    front.registers.lines_in = 0xFF
    assert card.read_lines() == 0xFF
    card.set_line(0, True)
    card.set_line(3, True)
    assert card.lines == 0b1001
    assert len(rig.trigger_edges) == 1


def test_a_slow_amplifier_follows_on_a_ramp() -> None:
    rig, front = bench(amplifier=AmplifierData(slew=1000.0))
    card = card_on(front, rig)
    card.power_up()
    card.write(0, 2.0)
    rig.wait(0.02)
    assert rig.volts == pytest.approx(20.0, abs=2.6)
    card.write(0, 0.0)
    rig.wait(0.01)
    assert rig.volts == pytest.approx(10.0, abs=1.5)
    rig.wait(0.02)
    assert rig.volts == 0.0
    assert rig.extremes.largest_step < 4.0


def test_the_output_stays_when_the_program_goes() -> None:
    rig, front = bench()
    card = card_on(front, rig)
    card.power_up()
    card.write(0, 3.0)
    card.close()
    assert rig.volts == pytest.approx(60.0, abs=0.02)


def test_over_tcp_the_card_behaves_as_in_the_process() -> None:
    rig, front = bench(wires=Wires(noise=0.0))
    registers = SocketRegisters(front.start())
    try:
        card = card_on(front, rig, registers)
        card.power_up()
        card.write(0, 2.5)
        rig.wait(1e-3)
        assert card.convert([0])[0] == 2.5
        assert rig.volts == 50.0
    finally:
        registers.close()
        front.stop()


def test_a_cut_connection_a_slow_answer_and_nobody_there() -> None:
    rig, front = bench()
    address = front.start()
    try:
        registers = SocketRegisters(address)
        card = card_on(front, rig, registers)
        card.power_up()
        front.faults.cut = 1
        with pytest.raises(LinkLost, match="link lost"):
            card.write(0, 1.0)
        with pytest.raises(LinkLost, match="closed"):
            card.write(0, 1.0)

        slow = SocketRegisters(address, timeout=0.02)
        front.faults.delay = 0.08
        with pytest.raises(TimedOut):
            slow.read32(3, 0x68)
        front.faults.delay = 0.0
        with pytest.raises(LinkLost, match="closed"):
            slow.read32(3, 0x68)
        again = SocketRegisters(address)
        assert again.read32(3, 0x68) & ENABLE
        again.close()
    finally:
        front.stop()
    with pytest.raises(LinkLost, match="no connection"):
        SocketRegisters(address)


def test_a_second_program_may_look_but_not_drive_while_the_first_lives() -> None:
    rig, front = bench()
    address = front.start()
    first, second = SocketRegisters(address), SocketRegisters(address)
    card = card_on(front, rig, first)
    try:
        card.power_up()
        card.write(0, 2.0)
        assert second.read32(3, 0x68) & ENABLE
        before = len(front.log)
        with pytest.raises(LinkLost, match="another program drives this card") as refused:
            card_on(front, rig, second).power_up()
        assert "\n" not in str(refused.value)
        assert not any(e.kind in (WRITE16, WRITE32) for e in list(front.log)[before:])
        with pytest.raises(LinkLost, match="closed"):
            second.read32(3, 0x68)
        for reads in ((Access(AccessKind.READ16, 2, 0x20),), (Access(AccessKind.READ16, 2, 0x00),)):
            with pytest.raises(LinkLost, match="another program"):
                SocketRegisters(address).batch(reads)
        assert card.write(0, 1.0) == pytest.approx(1.0, abs=1e-3)
        first.close()
        third = SocketRegisters(address)
        third.write16(2, 0x20, 0x2000)
        assert rig.volts == 0.0
        third.close()
    finally:
        first.close()
        second.close()
        front.stop()


def test_an_interruption_in_the_middle_of_an_exchange_does_not_shift_the_answers() -> None:
    rig, front = bench(wires=Wires(noise=0.0))
    address = front.start()
    registers = SocketRegisters(address)
    card = card_on(front, rig, registers)
    card.power_up()

    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        front.faults.delay = 0.05
        signal.setitimer(signal.ITIMER_REAL, 0.02)
        with pytest.raises(KeyboardInterrupt):
            card.write(0, 4.0)
        front.faults.delay = 0.0
        front.registers.lines_in = 0x5A
        assert card.read_lines() == 0x5A
        assert card.write(0, 1.0) == pytest.approx(1.0, abs=1e-3)
        assert rig.volts == pytest.approx(20.0, abs=0.02)
    finally:
        signal.signal(signal.SIGALRM, before)
        registers.close()
        front.stop()


def test_unknown_cards_are_refused() -> None:
    rig, _ = bench()
    with pytest.raises(ValueError, match="no card"):
        CardFront(rig, model="MF614")


def test_the_noise_of_the_inputs_is_as_told() -> None:
    rig, front = bench(wires=Wires(noise=5e-3))
    card = card_on(front, rig)
    card.power_up()
    read = np.array([card.convert([3])[0] for _ in range(400)])
    assert read.std() == pytest.approx(5e-3, rel=0.15)
