"""The guard of single voltages: order, states, interrupts, links, watchdogs."""

from __future__ import annotations

import json
import math
import threading
import time
from dataclasses import dataclass
from typing import Any

import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Identity, VoltageOut
from hardware.envelope import Converter, Dwell, Envelope, GuardedOutput, OutputState
from hardware.errors import HardwareError, LimitViolation, LinkLost, ProtocolFault
from tests.counted import calls
from tests.hardware.envelope.device import (
    Device,
    FedDevice,
    Interrupts,
    RawDevice,
    TrueTime,
    unsafe,
)
from tests.patience import HANGS

LIMITS = Envelope(-20.0, 100.0, 1e4, gentle=500.0, update_period=1e-3)


@dataclass
class Bench:
    device: Device
    raw: RawDevice
    output: GuardedOutput
    clock: TrueTime
    interrupts: Interrupts

    def causes(self) -> list[str]:
        return [s[3] for s in self.device.steps]


def bench(
    envelope: Envelope = LIMITS,
    *,
    watchdog: float = 0.0,
    can_read: bool = True,
    up: bool = True,
    **options: Any,
) -> Bench:
    interrupts = Interrupts()
    clock = TrueTime(interrupts)
    device = Device(clock, watchdog)
    raw = (FedDevice if watchdog else RawDevice)(device, can_read)
    output = GuardedOutput(raw, envelope, clock, **options)
    if up:
        output.power_up()
    return Bench(device, raw, output, clock, interrupts)


def test_nothing_happens_before_power_up() -> None:
    b = bench(up=False)
    assert isinstance(b.output, VoltageOut)
    assert "not powered up" in str(b.output.status)
    before = b.output.present
    assert before is None
    for command in (lambda: b.output.set(1.0), lambda: b.output.ramp(1.0), b.output.read):
        with pytest.raises(LimitViolation, match="power"):
            command()
    b.output.stop()
    b.output.tend()
    assert b.device.steps == []
    b.output.power_up()
    assert b.causes()[0] == "power-up"
    assert b.output.present == 0.0
    assert b.output.state is OutputState.PARKED


def test_power_up_goes_on_to_the_safe_value() -> None:
    b = bench(Envelope(-20.0, 100.0, 1e4, safe=10.0, gentle=500.0))
    assert b.device.volts == b.output.present == 10.0
    assert b.output.state is OutputState.PARKED


def test_power_up_of_a_driven_output_ramps_down_first() -> None:
    b = bench()
    b.output.ramp(80.0)
    b.output.power_up()
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []
    powered = [s for s in b.device.steps if s[3] == "power-up"]
    assert powered[-1][1:3] == (0.0, 0.0)


def test_a_read_back_that_contradicts_the_power_up_is_told() -> None:
    b = bench(up=False)
    b.raw.read = lambda: 40.0  # type: ignore[method-assign]
    with pytest.raises(ProtocolFault, match="reads 40 V instead of 0 V"):
        b.output.power_up()
    assert b.output.state is OutputState.UNKNOWN


def test_set_and_ramp_keep_limits_and_time() -> None:
    b = bench()
    b.output.set(10.0)
    b.output.set(20.0)
    times = [s[0] for s in b.device.steps]
    assert times[-1] - times[-2] == pytest.approx(1e-3)
    begin, count = b.clock.true, len(b.device.steps)
    b.output.ramp(100.0)
    assert b.clock.true - begin == pytest.approx(0.16)
    assert len(b.device.steps) - count == 80
    b.output.ramp(0.0, 1e4)
    assert b.clock.true - begin == pytest.approx(0.18)
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []
    sent = len(b.device.steps)
    for wrong in (101.0, -21.0, 50.0, math.nan, "1", None):
        with pytest.raises(LimitViolation):
            b.output.set(wrong)  # type: ignore[arg-type]
    assert len(b.device.steps) == sent
    assert b.output.present == 0.0


def test_a_clock_that_stands_still_or_goes_back() -> None:
    b = bench()
    b.output.set(5.0)
    b.clock.jump -= 3600.0
    b.output.set(10.0)
    times = [s[0] for s in b.device.steps]
    assert times[-1] - times[-2] == pytest.approx(1e-3)
    b.clock.now = lambda: 7.0  # type: ignore[method-assign]
    b.output.set(5.0)
    with pytest.raises(LimitViolation, match="the clock stands still"):
        b.output.set(5.0)


def test_clamping_is_opt_in_and_marked() -> None:
    b = bench(clamp=True)
    b.output.ramp(500.0)
    assert (b.output.present, b.output.clamped) == (100.0, True)
    b.output.set(95.0)
    assert not b.output.clamped
    with pytest.raises(LimitViolation, match="finite"):
        b.output.set(math.inf)
    with pytest.raises(LimitViolation, match="step"):
        b.output.set(-500.0)
    told = b.output.provenance()
    assert told["clamp"] is True
    assert told["clamped_commands"] == 2


def test_the_converter_narrows_the_limits() -> None:
    b = bench(converter=Converter(-10.0, 60.0))
    assert b.output.limits == (-10.0, 60.0)
    with pytest.raises(LimitViolation, match="converter"):
        b.output.ramp(70.0)
    with pytest.raises(UnusableInput, match="parking needs 80 V"):
        bench(Envelope(0.0, 100.0, 1e4, safe=80.0), converter=Converter(-10.0, 60.0))
    with pytest.raises(UnusableInput, match="power-up leaves 0 V"):
        bench(Envelope(10.0, 100.0, 1e4, safe=10.0))


@pytest.mark.parametrize("arrived", [0, 5, 8, 9, 10])
def test_a_link_lost_at_any_byte_makes_the_output_unknown(arrived: int) -> None:
    b = bench()
    b.output.ramp(50.0)
    b.device.budget = arrived
    with pytest.raises(LinkLost):
        b.output.set(55.0)
    assert b.output.present is None
    assert "set at 50 V failed: LinkLost" in str(b.output.status)
    assert "no watchdog" in str(b.output.status)
    with pytest.raises(LimitViolation, match=r"unknown.*stop\(\) or power_up\(\)"):
        b.output.set(1.0)
    with pytest.raises(LimitViolation, match="unknown"):
        b.output.ramp(0.0)
    told = json.loads(json.dumps(b.output.provenance()))
    assert told["state"] == told["state_if_program_dies"] == "unknown"
    assert told["volts"] is None
    assert len(told["faults"]) == 1
    b.output.stop()
    assert b.output.state is OutputState.PARKED
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []
    assert "power-up" not in b.causes()[1:]


def test_without_a_read_back_an_unknown_output_is_powered_up_anew() -> None:
    b = bench(can_read=False)
    b.output.ramp(50.0)
    b.device.budget = 0
    with pytest.raises(LinkLost):
        b.output.set(55.0)
    b.output.stop()
    assert b.causes()[-2:] == ["power-up", "write"]
    assert b.device.volts == 0.0
    assert b.output.state is OutputState.PARKED


def test_a_device_that_is_gone_stays_unknown() -> None:
    b = bench()
    b.output.ramp(50.0)
    b.device.reachable = False
    with pytest.raises(LinkLost) as caught:
        b.output.stop()
    assert "second attempt" in caught.value.__notes__[0]
    assert b.output.state is OutputState.UNKNOWN
    with pytest.raises(LinkLost):
        b.output.close()
    assert b.raw.closed == 1
    b.output.close()
    with pytest.raises(LimitViolation, match="closed"):
        b.output.power_up()


@pytest.mark.parametrize("place", range(12))
def test_ctrl_c_anywhere_in_a_command_can_be_parked_from(place: int) -> None:
    b = bench()
    b.output.ramp(50.0)
    b.interrupts.left = place
    try:
        b.output.set(60.0)
        b.output.set(70.0)
        b.output.set(80.0)
    except KeyboardInterrupt:
        pass
    b.interrupts.left = None
    b.output.stop()
    assert b.device.volts == b.output.present == 0.0
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


@pytest.mark.parametrize("place", range(12))
def test_ctrl_c_while_the_clock_is_read_leaves_what_is_known_true(place: int) -> None:
    b = bench()
    b.output.ramp(50.0)
    now, interrupts = b.clock.now, Interrupts()

    def read() -> float:
        interrupts.place()
        return now()

    b.clock.now = read  # type: ignore[method-assign]
    interrupts.left = place
    try:
        b.output.set(60.0)
        b.output.set(70.0)
        b.output.set(80.0)
    except KeyboardInterrupt:
        pass
    interrupts.left = None
    assert b.output.present == b.device.volts
    b.output.stop()
    assert b.device.volts == b.output.present == 0.0
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


def test_the_own_refusal_of_a_device_changes_nothing() -> None:
    b = bench()

    def refuse(volts: float) -> None:
        raise LimitViolation("the amplifier is set to 0 .. 1 V")

    b.raw.write = refuse  # type: ignore[method-assign]
    with pytest.raises(LimitViolation, match="amplifier"):
        b.output.set(5.0)
    assert b.output.present == 0.0


def test_dwell_is_ended_by_whoever_tends() -> None:
    b = bench(Envelope(-20.0, 100.0, 1e4, gentle=1e3, dwell=[Dwell(80.0, 1.0)]))
    b.output.ramp(90.0)
    b.clock.sleep(0.9)
    b.output.tend()
    b.output.ramp(79.0)
    b.output.ramp(90.0)
    b.clock.sleep(0.98)
    b.output.tend()
    b.clock.sleep(0.1)
    with pytest.raises(LimitViolation, match="beyond 80 V"):
        b.output.set(91.0)
    with pytest.raises(LimitViolation, match="ramped to 0 V"):
        b.output.tend()
    assert b.output.state is OutputState.PARKED


def test_a_watchdog_is_fed_by_every_command_and_by_tending() -> None:
    b = bench(watchdog=0.3)
    assert isinstance(b.raw, FedDevice)
    b.output.ramp(100.0, 100.0)
    assert b.raw.fed >= 9
    for _ in range(10):
        b.clock.sleep(0.2)
        b.output.tend()
    assert b.device.volts == 100.0
    assert "watchdog parks it" in str(b.output.status)
    assert b.output.provenance()["state_if_program_dies"] == "parked"
    b.clock.sleep(0.5)
    assert b.device.volts == 0.0
    assert b.output.present is None
    assert "300 ms of its watchdog" in str(b.output.status)
    b.output.stop()
    assert b.output.state is OutputState.PARKED
    b.output.ramp(5.0)
    b.device.reachable = False
    b.clock.sleep(0.2)
    with pytest.raises(LinkLost, match="sign of life"):
        b.output.tend()
    assert "output unknown" in str(b.output.status)


def test_a_watchdog_needs_a_time() -> None:
    device = Device(TrueTime(), 0.3)
    with pytest.raises(UnusableInput, match="watchdog"):
        GuardedOutput(_Timeless(device), LIMITS)


class _Timeless(FedDevice):
    @property
    def watchdog_timeout(self) -> float:
        return 0.0


def test_stop_overrules_a_ramp_of_another_thread() -> None:
    reached = threading.Event()

    class Slow(TrueTime):
        def sleep(self, seconds: float) -> None:
            super().sleep(seconds)
            if self.device is not None and self.device.volts > 20.0:
                reached.set()
            time.sleep(1e-4)

    clock = Slow()
    device = Device(clock)
    output = GuardedOutput(RawDevice(device), LIMITS, clock)
    output.power_up()
    caught: list[BaseException] = []

    def climb() -> None:
        try:
            output.ramp(100.0)
        except HardwareError as error:
            caught.append(error)

    thread = threading.Thread(target=climb)
    thread.start()
    assert reached.wait(HANGS)
    output.stop()
    thread.join(HANGS)
    assert "ended on its way" in str(caught[0])
    assert device.volts == 0.0
    assert unsafe(device, -20.0, 100.0, 10.0) == []


def test_a_command_is_a_handful_of_calls() -> None:
    class Free:
        identity = Identity()
        has_watchdog = False

        def power_up(self) -> None: ...

        def write(self, volts: float) -> None: ...

        def read(self) -> None: ...

        def close(self) -> None: ...

    clock = TrueTime()
    output = GuardedOutput(Free(), LIMITS, clock)
    output.power_up()

    def work() -> None:
        for k in range(400):
            output.set(5.0 * (k & 1))

    assert calls(work) < 400 * 60
