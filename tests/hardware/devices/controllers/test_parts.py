"""Small parts: walking to the safe voltage, error numbers, missing drivers, the simulator's own."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.devices.controllers import GatewayTransport, GcsSetup, GcsTalk, device_error
from hardware.devices.controllers.gcs_errors import MEANINGS
from hardware.devices.walking import WalkToRest, walk
from hardware.errors import DriverMissing, LimitViolation, LinkLost, Overrun, ProtocolFault
from hardware.simulators.control.client import LocalClock
from hardware.simulators.controllers.gcs_device import GcsDevice
from hardware.simulators.controllers.gcs_model import GcsModel
from hardware.simulators.rig import DeviceClock, Rig
from tests.hardware.devices.controllers.bench import Spring, bench


@pytest.mark.parametrize("present", [35.0, -7.0, 0.3, 0.0])
def test_walk(present: float) -> None:
    rig = Rig(Spring())
    rig.drive(present)
    walk(rig.drive, present, 0.0, WalkToRest(100.0), LocalClock(rig))
    assert rig.volts == 0.0
    assert rig.extremes.largest_step <= max(1.0 + 1e-9, abs(present))
    assert rig.now == pytest.approx(abs(present) / 100.0, abs=0.011)


def test_walk_from_nowhere_sets_the_target_only() -> None:
    sent: list[float] = []
    walk(sent.append, None, 5.0, WalkToRest(100.0), LocalClock(Rig(Spring())))
    assert sent == [5.0]


def test_error_numbers() -> None:
    for number in MEANINGS:
        error = device_error(number, "SVA 1 2", "here")
        assert error.partial == number
        assert f"error {number} " in str(error)
    assert isinstance(device_error(302, "SVA 1 150", "here"), LimitViolation)
    assert isinstance(device_error(403, "WAV", "here"), Overrun)
    assert isinstance(device_error(-999, "x" * 500, "here"), ProtocolFault)
    assert len(str(device_error(-999, "x" * 500, "here"))) < 200


def test_without_pipython(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pipython.pidevice.interfaces.pisocket", None)
    with pytest.raises(DriverMissing, match="pip install"):
        GatewayTransport.by_pisocket("127.0.0.1", 1).open()


def test_never_opened() -> None:
    talk = GcsTalk(GatewayTransport.by_pisocket("127.0.0.1", 1))
    with pytest.raises(LinkLost, match="not open"):
        talk.send("SVA 1 0")
    talk.close()


def test_setup_is_checked() -> None:
    with pytest.raises(UnusableInput, match="scale"):
        GcsSetup(scale=0.0)


def test_values_that_are_no_numbers() -> None:
    with bench("own") as there:
        there.controller.open()
        for answer, ask in (("1=nan", "position"), ("1=", "position"), ("2=5.0", "position")):
            there.front.device._asks["POS?"] = lambda a, answer=answer: [answer]  # type: ignore[misc]
            with pytest.raises(ProtocolFault, match="no answer to"):
                getattr(there.controller, ask)()
        assert there.controller.read() == 0.0


def answers(device: GcsDevice, text: bytes) -> bytes:
    return b"".join(device.feed(text))


def test_simulated_controller_refuses_as_the_public_list_has_it() -> None:
    rig = Rig(Spring())
    device = GcsDevice(rig, DeviceClock(), GcsModel(points=100, tables=2))
    for command, number in (
        (b"SVA 1 121", 302),
        (b"SVA 1 nan", 25),
        (b"SVA 1 x", 1),
        (b"SVA 2 1", 15),
        (b"SVA 1", 24),
        (b"MOV 1 1", 5),
        (b"WGO 1 1", 75),
        (b"WAV 1 X PNT 1 3 1 2", 404),
        (b"WAV 1 X PNT 1 1 nan", 25),
        (b"WAV 1 X RAMP 1 1 1", 402),
        (b"WAV", 1),
        (b"WTR 1 0 0", 17),
        (b"DRC 9 1 2", 57),
        (b"DRC 1 1 99", 58),
        (b"DRR? 1 5 1", 77),
        (b"VOL? 7", 23),
        (b"SPA? 1 0x1", 54),
        (b"POS? " + b"1 " * 40, 24),
        (b"NONE", 2),
        (b"\x18", 10),
    ):
        assert answers(device, command + b"\nERR?\nERR?\n") == b"%d\n0\n" % number, command
    assert rig.extremes.highest == 0.0


def test_simulated_controller_keeps_its_memory_bounded() -> None:
    device = GcsDevice(Rig(Spring()), DeviceClock(), GcsModel())
    assert answers(device, b"x" * 100_000 + b"\nERR?\n") in (b"3\n", b"2\n")
    for number in range(250_000):
        device.commands.add(str(number))
    assert len(device.commands) <= 100_000
    assert device.commands[-1] == "249999"


def test_sine_table_and_running_generator() -> None:
    rig = Rig(Spring())
    device = GcsDevice(rig, DeviceClock(), GcsModel())
    text = b"WAV 1 X SIN_P 100 50 10 100 0 50\nWSL 1 1\nWGC 1 2\nWGO 1 1\nERR?\n\x09"
    assert answers(device, text) == b"0\n1\n"
    assert answers(device, b"SVA 1 3\nERR?\nWAV 1 X PNT 1 1 0\nERR?\n") == b"73\n73\n"
    rig.wait(100 * 50e-6)
    seen = rig.seen(np.asarray(np.arange(100) * 50e-6 + 1e-9, np.float64)).v
    np.testing.assert_allclose(seen, 35.0 - 25.0 * np.cos(2e-2 * np.pi * np.arange(100)), atol=1e-9)
    assert answers(device, b"\x09") == b"1\n"
    rig.wait(101 * 50e-6)
    assert answers(device, b"\x09") == b"0\n"
    assert rig.volts == pytest.approx(seen[-1])


def test_jitter_does_not_make_samples_change_places() -> None:
    rig = Rig(Spring())
    device = GcsDevice(rig, DeviceClock(jitter=2e-4, seed=5), GcsModel())
    points = b" ".join(b"%d" % k for k in range(25))
    answers(device, b"WAV 1 X PNT 1 25 " + points + b"\nWSL 1 1\nWGC 1 4\nWGO 1 1\n")
    rig.wait(0.1)
    assert rig.extremes.highest == 24.0
    assert rig.volts == 24.0
    assert not device.generator.running
