"""ASCII controllers over a real pseudo-terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import RawOutput
from hardware.devices.controllers import (
    ASCII_DIALECTS,
    MDT69X,
    NV200,
    AsciiController,
    AsciiDialect,
)
from hardware.devices.transport import SerialTransport
from hardware.errors import LimitViolation, LinkLost, ProtocolFault, TimedOut
from hardware.simulators.control.client import LocalClock
from hardware.simulators.controllers import ASCII_DEVICES, AsciiFront, CommandWatchdog, Fault
from hardware.simulators.controllers.ascii_devices import Nv200
from hardware.simulators.rig import Rig
from tests.hardware.devices.controllers.bench import TIMEOUT, Spring
from tests.hardware.waits import waits

SOON = 20.0 * TIMEOUT


@dataclass
class Line:
    rig: Rig
    front: AsciiFront
    controller: AsciiController


@contextmanager
def line(name: str, dialect: AsciiDialect | None = None) -> Iterator[Line]:
    rig = Rig(Spring())
    front = AsciiFront(rig, name)
    dialect = dialect or ASCII_DIALECTS[name]
    transport = SerialTransport(front.start(), dialect.settings)
    controller = AsciiController(dialect, transport, LocalClock(rig), TIMEOUT)
    try:
        yield Line(rig, front, controller)
    finally:
        controller.close()
        front.stop()


@pytest.fixture(params=sorted(ASCII_DIALECTS))
def there(request: pytest.FixtureRequest) -> Iterator[Line]:
    with line(request.param) as found:
        found.controller.power_up()
        found.controller.write(40.0)
        yield found


def test_every_dialect_has_a_simulated_device() -> None:
    assert set(ASCII_DIALECTS) == set(ASCII_DEVICES)


def test_contract(there: Line) -> None:
    assert isinstance(there.controller, RawOutput)
    assert not there.controller.has_watchdog
    identity = there.controller.identity
    assert identity.maker in ("piezosystem jena", "Thorlabs")
    assert "SIMSTACK" in identity.model or "MDT694B" in identity.model


def test_voltages(there: Line) -> None:
    for volts in (0.0, 12.345, 75.0):
        there.controller.write(volts)
        assert there.rig.volts == volts
        assert there.controller.read() == pytest.approx(volts, abs=0.01)


def test_limits(there: Line) -> None:
    assert there.controller.limits() in ((-20.0, 130.0), (0.0, 150.0), None)


def test_over_voltage_is_refused_by_the_device(there: Line) -> None:
    with pytest.raises(LimitViolation):
        there.controller.write(151.0)
    assert there.rig.volts == 40.0
    assert there.rig.extremes.highest == 40.0
    assert there.controller.read() == pytest.approx(40.0)


@pytest.mark.parametrize("volts", [np.nan, np.inf])
def test_no_number_is_refused_before_a_byte_leaves(there: Line, volts: float) -> None:
    before = len(there.front.device.commands)
    with pytest.raises(LimitViolation):
        there.controller.write(volts)
    assert len(there.front.device.commands) == before


def test_late_answer_is_not_taken_for_the_next_one(there: Line) -> None:
    there.front.faults.next(Fault(delay=2.0 * TIMEOUT))
    with pytest.raises((TimedOut, ProtocolFault)):
        there.controller.read()
    there.controller.write(41.0)
    assert there.controller.read() == pytest.approx(41.0)


def test_byte_by_byte(there: Line) -> None:
    there.front.faults.always(Fault(chunk=1))
    there.controller.write(41.0)
    assert there.controller.read() == pytest.approx(41.0)


def test_silence_and_garbage(there: Line) -> None:
    for fault in (Fault(silent=True), Fault(garbage=b"\xfe\xff"), Fault(terminator=b"\r")):
        there.front.faults.next(fault)
        with pytest.raises((TimedOut, ProtocolFault)):
            there.controller.read()
        assert there.controller.read() == pytest.approx(40.0)


def test_cable_pulled_in_the_middle_of_an_answer(there: Line) -> None:
    there.front.faults.next(Fault(drop_after=3))
    with waits() as waited:
        with pytest.raises(LinkLost):
            there.controller.read()
        there.controller.close()
        there.controller.close()
    assert waited.seconds < SOON
    with pytest.raises(LinkLost):
        there.controller.write(0.0)


def test_dead_device_closes_the_link(there: Line) -> None:
    there.front.faults.always(Fault(silent=True))
    with waits() as waited, pytest.raises(LinkLost, match="open the link again"):
        there.controller.read()
    assert waited.seconds < SOON


def test_power_up_walks_down() -> None:
    with line("nv200") as there:
        there.controller.power_up()
        there.controller.write(50.0)
        first = len(there.front.device.commands)
        there.controller.power_up()
        sent = [c for c in there.front.device.commands[first:] if c.startswith("set,")]
        assert np.abs(np.diff([50.0, *(float(c[4:]) for c in sent)])).max() <= 1.0 + 1e-9
        assert there.rig.volts == 0.0


def test_a_setpoint_that_does_not_stand_is_a_fault() -> None:
    with line("nv200", replace(NV200, set_voltage="avmin,{volts:.3f}", name="odd")) as there:
        there.controller.open()
        with pytest.raises(ProtocolFault):
            there.controller.write(10.0)


def test_unknown_command_is_told() -> None:
    with line("mdt69x", replace(MDT69X, set_voltage="wvoltage={volts:.2f}")) as there:
        there.controller.open()
        with pytest.raises(ProtocolFault, match="CMD_NOT_DEFINED"):
            there.controller.write(10.0)


def test_wrong_device() -> None:
    with line("mdt69x", NV200) as there:
        with pytest.raises((ProtocolFault, TimedOut)):
            there.controller.open()
        with pytest.raises(LinkLost, match="not open"):
            there.controller.write(1.0)


def test_watchdog_option() -> None:
    rig = Rig(Spring())
    device = Nv200(rig, CommandWatchdog(0.2))
    front = AsciiFront(rig, device)
    controller = AsciiController(
        NV200, SerialTransport(front.start()), LocalClock(rig), TIMEOUT, watchdog=True
    )
    controller.power_up()
    controller.write(60.0)
    controller.close()
    rig.wait(1.0)
    assert rig.volts == 0.0
    front.stop()


@pytest.mark.parametrize(
    "changes",
    [
        {"identity": ()},
        {"set_voltage": "set,1"},
        {"voltage_pattern": "no group"},
        {"settings": replace(NV200.settings, xon_xoff=True)},
    ],
)
def test_recipes_are_checked(changes: dict[str, object]) -> None:
    with pytest.raises(UnusableInput, match="nv200"):
        replace(NV200, **changes)  # type: ignore[arg-type]
