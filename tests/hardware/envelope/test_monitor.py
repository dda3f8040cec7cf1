"""A monitor that tells something else than was commanded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.envelope import Converter, Envelope, GuardedOutput, OutputState, check_monitor
from hardware.errors import HardwareError, LimitViolation, ProtocolFault
from tests.hardware.envelope.device import Device, RawDevice, TrueTime, unsafe
from tests.hardware.envelope.test_guard import LIMITS, Bench, bench

TIME = np.arange(400) / 1e3
WAVE = 50.0 - 50.0 * np.cos(2.0 * np.pi * 5.0 * TIME)


class Scaled(RawDevice):
    """A monitor with a scale and an offset of its own."""

    def __init__(self, device: Device, scale: float, offset: float = 0.0) -> None:
        super().__init__(device)
        self.scale, self.offset = scale, offset

    def read(self) -> float | None:
        volts = super().read()
        return None if volts is None else self.scale * volts + self.offset


def scaled(scale: float, offset: float = 0.0, **options: Any) -> tuple[Device, GuardedOutput]:
    clock = TrueTime()
    device = Device(clock)
    return device, GuardedOutput(Scaled(device, scale, offset), LIMITS, clock, **options)


@pytest.mark.parametrize(
    ("scale", "cause"),
    [(2.0, "gain or the scale"), (0.5, "gain or the scale"), (-1.0, "sign"), (0.0, "not wired")],
)
def test_power_up_refuses_a_read_back_that_does_not_follow(scale: float, cause: str) -> None:
    device, output = scaled(scale)
    with pytest.raises(ProtocolFault, match=cause) as caught:
        output.power_up()
    assert "\n" not in str(caught.value)
    assert f"a step of 2.4 V was read as {2.4 * scale:.4g} V" in str(caught.value)
    assert device.volts == 0.0
    assert max(s[2] for s in device.steps) == pytest.approx(2.4)
    for command in (output.set, output.ramp):
        with pytest.raises(LimitViolation, match=cause):
            command(1.0)
    output.stop()
    # the safe value was commanded, but what that is worth is not known
    assert output.state is OutputState.UNKNOWN
    with pytest.raises(LimitViolation, match=cause):
        output.set(1.0)
    assert device.volts == 0.0
    assert "failed" in output.provenance()["monitor"]


@pytest.mark.parametrize("scale", [0.82, 1.0, 1.23])
def test_power_up_accepts_what_follows(scale: float) -> None:
    device, output = scaled(scale, offset=3.0)
    output.power_up()
    assert device.volts == 0.0
    assert output.state is OutputState.PARKED
    output.set(5.0)
    assert "a step of 2.4 V" in output.provenance()["monitor"]


def test_the_step_of_the_proof() -> None:
    device, output = scaled(2.0, probe=0)
    output.power_up()
    assert all(s[2] == 0.0 for s in device.steps)
    assert "probe=0" in output.provenance()["monitor"]
    assert output.provenance()["probe"] == 0.0
    device, output = scaled(1.0, probe=7.0)
    output.power_up()
    assert max(s[2] for s in device.steps) == 7.0
    b = bench(Envelope(-20.0, 100.0, 1e4, safe=100.0, gentle=500.0))
    assert b.output.provenance()["probe"] == pytest.approx(-2.4)
    for probe in (1e-3, 200.0, -1.0, float("nan")):
        with pytest.raises(UnusableInput, match="probe"):
            scaled(1.0, probe=probe)
    coarse = bench(converter=Converter(-20.0, 100.0, 0.5))
    assert coarse.output.provenance()["probe"] == pytest.approx(5.05)
    silent = bench(can_read=False)
    assert "no read-back" in silent.output.provenance()["monitor"]
    silent.output.set(1.0)


def test_a_power_up_that_broke_off_has_proven_nothing() -> None:
    b = bench(up=False)
    b.device.budget = 60
    with pytest.raises(HardwareError):
        b.output.power_up()
    b.output.stop()
    assert b.output.state is OutputState.PARKED
    with pytest.raises(LimitViolation, match=r"call power_up\(\) first"):
        b.output.set(1.0)
    b.output.power_up()
    b.output.set(1.0)


def fail_at(b: Bench, error: Exception) -> None:
    """Let the next command fail with an error."""
    write = b.raw.write

    def fail(volts: float) -> None:
        b.raw.write = write  # type: ignore[method-assign]
        b.device.move(volts, "write")
        raise error

    b.raw.write = fail  # type: ignore[method-assign]


def test_a_read_back_far_from_the_last_command_is_not_believed() -> None:
    b = bench()
    b.output.ramp(80.0)
    fail_at(b, OSError("gone"))
    with pytest.raises(OSError, match="gone"):
        b.output.set(81.0)
    b.raw.read = lambda: 0.0  # type: ignore[method-assign]
    begin = len(b.device.steps)
    b.output.stop()
    assert b.device.volts == 0.0
    assert len(b.device.steps) - begin > 50
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []
    assert b.output.state is OutputState.PARKED
    assert "read-back of 0 V contradicts the 80.5 V last commanded" in str(b.output.status)
    with pytest.raises(LimitViolation, match=r"contradicts.*power_up\(\)"):
        b.output.set(1.0)


def test_without_a_proof_not_even_a_lost_link_makes_it_credible() -> None:
    b = bench(probe=0)
    b.output.ramp(80.0)
    b.device.budget = 0
    with pytest.raises(HardwareError):
        b.output.set(81.0)
    b.device.connect()
    b.raw.read = lambda: 0.0  # type: ignore[method-assign]
    b.output.stop()
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []
    assert b.device.volts == 0.0


def test_a_device_that_was_off_and_on_is_not_driven_up_again() -> None:
    b = bench()
    b.output.ramp(80.0)
    b.device.power_cycle()
    with pytest.raises(HardwareError):
        b.output.set(81.0)
    begin = len(b.device.steps)
    b.output.stop()
    assert [s[2] for s in b.device.steps[begin:]] == [0.0]
    assert "restart" in str(b.output.status)


class Resting(RawDevice):
    """Goes on to 20 V at the end of its power-up, as a controller with another safe value."""

    rest = 20.0

    def power_up(self) -> None:
        super().power_up()
        self.device.command(self.rest, "walk")


@pytest.mark.parametrize("found", [0.0, 20.0], ids=["off and on", "parked by itself"])
def test_a_device_that_rests_elsewhere_is_not_driven_up_again_either(found: float) -> None:
    clock = TrueTime()
    device = Device(clock)
    limits = Envelope(-20.0, 100.0, 1e4, gentle=500.0, safe=20.0)
    output = GuardedOutput(Resting(device), limits, clock)
    output.power_up()
    output.ramp(80.0)
    device.power_cycle()
    device.volts = found
    with pytest.raises(HardwareError):
        output.set(81.0)
    begin = len(device.steps)
    output.stop()
    assert max(s[2] for s in device.steps[begin:]) == 20.0
    assert unsafe(device, -20.0, 100.0, 10.0) == []
    assert "restart" in str(output.status)


def test_the_safe_value_is_written_whatever_is_known() -> None:
    b = bench()
    b.device.volts = 3.0
    b.output.stop()
    assert b.device.volts == 0.0


def test_readings_that_follow_pass() -> None:
    late = np.concatenate([[np.nan], WAVE[:-1]])
    rng = np.random.default_rng(1)
    assert check_monitor(LIMITS, WAVE, WAVE + 0.02 * rng.standard_normal(400)) == 0
    assert check_monitor(LIMITS, late, late) == 0
    spikes = WAVE.copy()
    spikes[100:108] += 50.0
    assert check_monitor(LIMITS, WAVE, spikes) == 0
    lagging = np.concatenate([np.full(12, WAVE[0]), WAVE[:-12]])
    with pytest.raises(LimitViolation):
        check_monitor(LIMITS, WAVE, lagging)
    assert check_monitor(LIMITS, WAVE, lagging, lag=12) == 0
    assert check_monitor(LIMITS, [], [], 5) == 5


@pytest.mark.parametrize("wrong", [2.0 * WAVE, -WAVE, 0.0 * WAVE, WAVE + 10.0])
def test_readings_that_do_not_follow_are_told(wrong: np.ndarray) -> None:
    with pytest.raises(LimitViolation, match="samples in a row beyond 6 V"):
        check_monitor(LIMITS, WAVE, wrong)


def test_a_run_is_counted_across_chunks() -> None:
    wanted, told = np.full(4, 50.0), np.full(4, 20.0)
    count = check_monitor(LIMITS, wanted, told)
    count = check_monitor(LIMITS, wanted, told, count)
    assert count == 8
    assert check_monitor(LIMITS, wanted, wanted, count) == 0
    with pytest.raises(LimitViolation, match=r"20 V are read where 50 V.* 12 samples"):
        check_monitor(LIMITS, wanted, told, count)


def test_the_guard_drives_nothing_more_once_readings_have_differed() -> None:
    b = bench()
    b.output.ramp(50.0)
    assert b.output.compare(WAVE, WAVE) == 0
    with pytest.raises(LimitViolation, match="monitor"):
        b.output.compare(WAVE, 2.0 * WAVE)
    with pytest.raises(LimitViolation, match="monitor"):
        b.output.set(51.0)
    b.output.stop()
    assert b.device.volts == 0.0
    b.output.power_up()
    b.output.set(1.0)
    assert any("monitor" in f for f in b.output.provenance()["faults"])
