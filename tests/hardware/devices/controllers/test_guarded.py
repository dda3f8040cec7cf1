"""A controller behind the envelope's guard: what the actuator meets when the wire fails."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from hardware.devices.controllers import NV200, AsciiController, GcsSetup, GcsWave
from hardware.devices.transport import SerialTransport
from hardware.envelope import Envelope, GuardedOutput, GuardedWave, OutputState
from hardware.errors import HardwareError, LimitViolation, LinkLost, ProtocolFault
from hardware.simulators.control.client import LocalClock
from hardware.simulators.controllers import AsciiFront, CommandWatchdog, Fault, GcsModel
from hardware.simulators.rig import Rig
from tests.hardware.devices.controllers.bench import Bench, Spring, bench

LIMITS = Envelope(0.0, 100.0, 2e5, safe=0.0, gentle=1000.0)
WAYS = ("own", "pisocket")


@pytest.fixture(params=WAYS)
def there(request: pytest.FixtureRequest) -> Iterator[tuple[Bench, GuardedOutput]]:
    with bench(request.param, timeout=0.3) as b:
        output = GuardedOutput(b.controller, LIMITS, clock=b.clock)
        output.power_up()
        yield b, output


def test_nothing_beyond_the_envelope_is_sent(there: tuple[Bench, GuardedOutput]) -> None:
    b, output = there
    before = len(b.front.device.commands)
    for volts in (150.0, -1.0, np.nan, np.inf):
        with pytest.raises(LimitViolation):
            output.set(volts)
    assert len(b.front.device.commands) == before
    output.ramp(50.0)
    assert b.rig.volts == pytest.approx(50.0)
    output.stop()
    assert b.rig.volts == 0.0
    assert b.rig.extremes.largest_step <= 2.0


def test_guarded_wave_and_its_end(there: tuple[Bench, GuardedOutput]) -> None:
    b, output = there
    player = GuardedWave(output, GcsWave(b.controller))
    volts = 50.0 - 50.0 * np.cos(2.0 * np.pi * np.arange(1000) / 1000)
    player.prepare(volts, 10e3)
    assert [w.samples for w in player.play()][-1] == 1000
    player.prepare(volts, 10e3)
    playing = player.play()
    next(playing)
    playing.close()
    assert b.rig.volts == 0.0
    assert output.state is OutputState.PARKED
    assert b.rig.extremes.highest <= 100.0
    assert b.rig.extremes.largest_step <= 2.0


def test_pulled_cable_leaves_the_output_unknown_and_said_so(
    there: tuple[Bench, GuardedOutput],
) -> None:
    b, output = there
    output.ramp(60.0)
    b.front.faults.next(Fault(drop_after=1))
    with pytest.raises(LinkLost):
        output.set(61.0)
    assert output.present is None
    assert "keeps its voltage" in str(output.status)
    assert b.rig.volts == pytest.approx(61.0)
    output.stop()  # reconnects, reads back, walks down
    assert b.rig.volts == 0.0
    assert b.rig.extremes.largest_step <= 2.0


def test_dead_wire_and_a_watchdog() -> None:
    model = GcsModel(watchdog=CommandWatchdog(0.5, rate=1000.0))
    with bench("own", model, setup=GcsSetup(watchdog=True)) as b:
        output = GuardedOutput(b.controller, LIMITS, clock=b.clock)
        output.power_up()
        output.ramp(60.0)
        b.front.faults.refuse = True
        b.front.faults.always(Fault(drop_after=0))
        with pytest.raises(HardwareError):
            output.set(61.0)
        with pytest.raises(HardwareError):
            output.stop()
        assert "watchdog" in str(output.status)
        b.rig.wait(1.0)
        assert b.rig.volts == 0.0
        assert b.rig.extremes.largest_step <= 2.0


@pytest.mark.parametrize("left", [103.0, 110.0])
def test_the_walk_at_power_up_keeps_within_the_envelope(left: float) -> None:
    with bench("own") as b:
        b.front.device.axis.command(left)
        output = GuardedOutput(b.controller, LIMITS, clock=b.clock)
        if left > 105.0:
            with pytest.raises(ProtocolFault, match=r"stands at 110 V, outside the 0 \.\. 100 V"):
                output.power_up()
            assert b.rig.volts == left
        else:
            output.power_up()
            assert b.rig.volts == 0.0
        sent = [float(c.split()[2]) for c in b.front.device.commands if c.startswith("SVA ")]
        assert max(sent, default=0.0) <= 100.0


def test_a_controller_that_rests_elsewhere_than_at_zero_is_known_to() -> None:
    with bench("own", setup=GcsSetup(safe=20.0)) as b:
        output = GuardedOutput(b.controller, replace(LIMITS, safe=20.0), clock=b.clock)
        output.power_up()
        assert output.present == b.rig.volts == 20.0
        assert output.state is OutputState.PARKED
    rig = Rig(Spring())
    front = AsciiFront(rig, "nv200")
    line = SerialTransport(front.start())
    controller = AsciiController(NV200, line, LocalClock(rig), safe=20.0, gentle=1e3)
    try:
        output = GuardedOutput(controller, LIMITS, clock=LocalClock(rig))
        output.power_up()
        assert output.present == rig.volts == 0.0
        assert rig.extremes.largest_step <= 10.0
        assert max(float(c[4:]) for c in front.device.commands if c.startswith("set,")) == 20.0
    finally:
        controller.close()
        front.stop()
