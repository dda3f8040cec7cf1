"""PIPython, unmodified and by itself, in front of the simulated controller."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from hardware.simulators.controllers import Fault, GcsFront
from hardware.simulators.rig import Rig
from tests.hardware.devices.controllers.bench import Spring

pipython = pytest.importorskip("pipython", reason="PIPython is not installed")


@pytest.fixture
def there() -> Iterator[tuple[Rig, GcsFront, Any]]:
    from pipython.pidevice import GCS2Device
    from pipython.pidevice.interfaces.pisocket import PISocket

    rig = Rig(Spring())
    front = GcsFront(rig)
    host, _, port = front.start().rpartition(":")
    gateway = PISocket(host, int(port))
    gateway.settimeout(300)
    # not GCSDevice: its destructor closes the socket whenever it is collected
    yield rig, front, GCS2Device(gateway=gateway)
    gateway.close()
    front.stop()


def test_its_own_commands(there: tuple[Rig, GcsFront, Any]) -> None:
    rig, _, device = there
    assert device.qIDN().startswith("(c)Simulated")
    assert device.axes == ["1"]
    device.SVO("1", False)
    device.SVA("1", 30.0)
    rig.wait(0.01)
    assert rig.volts == 30.0
    assert device.qSVA("1")["1"] == 30.0
    assert device.qVOL(1)[1] == 30.0
    assert device.qPOS("1")["1"] == pytest.approx(0.9)
    assert device.qTMX()["1"] == 4.0
    assert device.qCST()["1"] == "SIMSTACK"
    assert device.HasVOL() is False
    assert device.HasqVOL()
    assert device.IsControllerReady()
    device.SVO("1", True)
    device.MOV("1", 1.5)
    rig.wait(0.2)
    assert device.qONT("1")["1"]


def test_its_own_error(there: tuple[Rig, GcsFront, Any]) -> None:
    _, _, device = there
    with pytest.raises(pipython.GCSError) as error:
        device.SVA("1", 500.0)
    assert error.value == 302


def fetched(device: Any) -> Any:
    while device.bufstate is not True:
        time.sleep(0.001)
    return device.bufdata


def test_its_own_wave_and_recorder(there: tuple[Rig, GcsFront, Any]) -> None:
    rig, _, device = there
    volts = 20.0 * np.sin(np.linspace(0.0, np.pi, 20))
    device.WAV_PNT(1, 1, 20, "X", list(volts))
    device.WSL(1, 1)
    device.WGC(1, 1)
    device.WTR(1, 1, 0)
    device.CTO(1, 3, 4)
    device.TWS([1, 1], [1, 2], [1, 0])
    device.DRC([1, 2], ["1", "1"], [2, 16])
    device.WGO(1, 1)
    assert device.IsGeneratorRunning(1)[1]
    rig.wait(0.1)
    assert not device.IsGeneratorRunning(1)[1]
    assert len(rig.trigger_edges) == 1
    header = device.qDRR([1, 2], 1, 20)
    values = fetched(device)
    assert header["NDATA"] == 20
    assert header["SAMPLE_TIME"] == pytest.approx(50e-6)
    np.testing.assert_allclose(values[1], volts, atol=2e-6)
    device.qGWD(1, 1, 20)
    np.testing.assert_allclose(fetched(device)[0], volts, atol=1e-6)


def test_the_fault_that_is_wrapped_is_still_there(there: tuple[Rig, GcsFront, Any]) -> None:
    _, front, device = there
    front.faults.next(Fault(delay=0.4))
    with pytest.raises(pipython.GCSError, match=r"(?i)time ?out"):
        device.qPOS("1")
    time.sleep(0.15)
    with pytest.raises(ValueError, match="format"):
        device.qSVA("1")
