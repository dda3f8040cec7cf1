"""The rows of the fault table that concern a controller, by our own socket and by PIPython's."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest

from hardware.errors import LimitViolation, LinkLost, ProtocolFault, TimedOut
from hardware.simulators.controllers import Fault
from tests.hardware.devices.controllers.bench import TIMEOUT, WAYS, Bench, bench
from tests.hardware.waits import waits

SOON = 20.0 * TIMEOUT


@pytest.fixture(params=WAYS)
def there(request: pytest.FixtureRequest) -> Iterator[Bench]:
    with bench(request.param, timeout=TIMEOUT) as b:
        b.controller.power_up()
        b.controller.write(40.0)
        b.rig.wait(0.01)
        yield b


def test_late_answer_is_not_taken_for_the_next_one(there: Bench) -> None:
    there.front.faults.next(Fault(delay=2.0 * TIMEOUT))
    with pytest.raises((TimedOut, ProtocolFault)):
        there.controller.position()
    assert there.controller.read() == pytest.approx(40.0)
    assert there.controller.position() == pytest.approx(1.2e-6, abs=1e-12)


def test_late_answer_to_the_error_question(there: Bench) -> None:
    there.front.faults.next(Fault(delay=2.0 * TIMEOUT))
    with pytest.raises((TimedOut, ProtocolFault)):
        there.controller.write(41.0)
    assert there.controller.read() == pytest.approx(41.0)
    there.controller.write(42.0)
    assert there.rig.volts == 42.0


def test_late_identity_leaves_no_second_one_behind(there: Bench) -> None:
    there.front.faults.next(Fault(delay=2.0 * TIMEOUT))
    with pytest.raises((TimedOut, ProtocolFault)):
        there.talk.ask("*IDN?")
    assert there.controller.read() == pytest.approx(40.0)


def test_too_late_answer_closes_the_link(there: Bench) -> None:
    there.front.faults.next(Fault(delay=30.0 * TIMEOUT))
    with waits() as waited:
        with pytest.raises(LinkLost):
            there.controller.position()
        with pytest.raises(LinkLost):
            there.controller.read()
    assert waited.seconds < SOON


def test_byte_by_byte(there: Bench) -> None:
    there.front.faults.always(Fault(chunk=1))
    for volts in (10.0, 20.0):
        there.controller.write(volts)
        assert there.controller.read() == pytest.approx(volts)


def test_split_answer(there: Bench) -> None:
    there.front.faults.next(Fault(chunk=4, pause=0.2 * TIMEOUT))
    assert there.controller.read() == pytest.approx(40.0)


def test_cable_pulled_in_the_middle_of_an_answer(there: Bench) -> None:
    there.front.faults.next(Fault(drop_after=3))
    with waits() as waited:
        with pytest.raises(LinkLost):
            there.controller.position()
        there.controller.close()
        there.controller.close()
    assert waited.seconds < SOON
    with pytest.raises(LinkLost):
        there.controller.write(0.0)
    there.controller.open()
    assert there.controller.read() == pytest.approx(40.0), "nothing moved meanwhile"


def test_own_client_notices_a_closed_link_at_once() -> None:
    with bench("own") as there:
        there.controller.open()
        there.front.faults.next(Fault(drop_after=0))
        with waits() as waited, pytest.raises(LinkLost) as lost:
            there.controller.position()
        assert waited.seconds == 0.0, "long before the time-out"
        assert "closed it" in str(lost.value)


def test_silence(there: Bench) -> None:
    there.front.faults.next(Fault(silent=True))
    with pytest.raises((TimedOut, ProtocolFault)):
        there.controller.position()
    assert there.controller.read() == pytest.approx(40.0)


@pytest.mark.parametrize("garbage", [b"\xff\x00#!", b"7=?\n", b"\n", b"12 \n\xfe"])
def test_garbage(there: Bench, garbage: bytes) -> None:
    there.front.faults.next(Fault(garbage=garbage))
    try:
        value = there.controller.position()
    except (ProtocolFault, TimedOut):
        pass
    else:
        assert garbage == b"\n", "only an empty line may be skipped"
        assert value == pytest.approx(1.2e-6, abs=1e-12)
    assert there.controller.position() == pytest.approx(1.2e-6, abs=1e-12)


def test_babble(there: Bench) -> None:
    there.front.faults.next(Fault(garbage=b"x" * 1_200_000))
    with pytest.raises((ProtocolFault, TimedOut)):
        there.controller.position()
    assert there.controller.position() == pytest.approx(1.2e-6, abs=1e-12)


@pytest.mark.parametrize("end", [b"\r", b"", b" \n"])
def test_wrong_terminator(there: Bench, end: bytes) -> None:
    there.front.faults.next(Fault(terminator=end))
    with pytest.raises((ProtocolFault, TimedOut)):
        there.controller.position()
    assert there.controller.position() == pytest.approx(1.2e-6, abs=1e-12)


def test_over_voltage_is_refused_by_the_device(there: Bench) -> None:
    with pytest.raises(LimitViolation, match="302") as refused:
        there.controller.write(150.0)
    assert refused.value.partial == 302
    assert there.rig.volts == 40.0
    assert there.rig.extremes.highest == 40.0
    assert there.controller.read() == pytest.approx(40.0)


@pytest.mark.parametrize("volts", [np.nan, np.inf, -np.inf])
def test_no_number_is_refused_before_a_byte_leaves(there: Bench, volts: float) -> None:
    before = len(there.front.device.commands)
    with pytest.raises(LimitViolation):
        there.controller.write(volts)
    assert len(there.front.device.commands) == before


def test_unknown_command_tells_its_number(there: Bench) -> None:
    with pytest.raises(ProtocolFault, match="error 2 ") as fault:
        there.talk.send("XYZ 1")
    assert fault.value.partial == 2
    with pytest.raises(ProtocolFault, match="error 2 "):
        there.talk.ask("XYZ?")
    assert there.controller.read() == pytest.approx(40.0)


def test_wrong_axis(there: Bench) -> None:
    with pytest.raises(ProtocolFault, match="no such axis"):
        there.talk.send("SVA 9 1.0")


@pytest.mark.parametrize("way", WAYS)
def test_nobody_there(way: str) -> None:
    with bench(way, timeout=TIMEOUT) as there:
        there.front.stop()
        with pytest.raises(LinkLost):
            there.controller.open()


@pytest.mark.parametrize("way", WAYS)
def test_refusal_to_accept_and_back_again(way: str) -> None:
    with bench(way, timeout=TIMEOUT) as there:
        there.front.faults.refuse = True
        time.sleep(0.06)
        with pytest.raises(LinkLost):
            there.controller.open()
        there.front.faults.refuse = False
        time.sleep(0.06)
        there.controller.open()
        assert there.controller.identity.serial == "0120034567"


@pytest.mark.parametrize("way", WAYS)
def test_something_else_answers(way: str) -> None:
    with bench(way, timeout=TIMEOUT) as there:
        there.front.faults.next(Fault(garbage=b"HTTP/1.1 400 Bad Request\n", terminator=b""))
        with pytest.raises((ProtocolFault, TimedOut)):
            there.controller.open()
        there.controller.close()


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("fault", [Fault(silent=True), Fault(garbage=b"nonsense\n")])
def test_link_is_closed_where_the_first_error_question_fails(way: str, fault: Fault) -> None:
    with bench(way, timeout=TIMEOUT) as there:
        there.front.faults.next(Fault(), fault)
        with pytest.raises((ProtocolFault, TimedOut)):
            there.controller.open()
        with pytest.raises(LinkLost, match="not open"):
            there.talk.ask("POS? 1")
        there.controller.open()
        assert there.controller.identity.serial == "0120034567"
