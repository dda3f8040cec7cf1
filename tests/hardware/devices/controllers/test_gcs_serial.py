"""GCS over a serial line: by our transport and by that of PIPython."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator

import numpy as np
import pytest

from hardware.devices.controllers import (
    GatewayTransport,
    GcsController,
    GcsRecorder,
    GcsTalk,
)
from hardware.devices.transport import SerialTransport
from hardware.errors import LinkLost
from hardware.simulators.control.client import LocalClock
from hardware.simulators.controllers import Fault, GcsFront
from hardware.simulators.rig import Rig
from tests.hardware.devices.controllers.bench import TIMEOUT, Spring
from tests.hardware.waits import waits


def talk_over(path: str, way: str) -> GcsTalk:
    if way == "own":
        return GcsTalk(SerialTransport(path), TIMEOUT)
    if importlib.util.find_spec("pipython") is None:
        pytest.skip("PIPython is not installed (pip install 'bondsight[bench]')")
    from pipython.pidevice.interfaces.piserial import PISerial

    return GcsTalk(GatewayTransport(lambda: PISerial(path, 115200), path), TIMEOUT)


@pytest.fixture(params=["own", "piserial"])
def there(request: pytest.FixtureRequest) -> Iterator[tuple[Rig, GcsFront, GcsController]]:
    rig = Rig(Spring())
    front = GcsFront(rig, over="pty")
    controller = GcsController(talk_over(front.start(), request.param), clock=LocalClock(rig))
    yield rig, front, controller
    controller.close()
    front.stop()


def test_all_is_well(there: tuple[Rig, GcsFront, GcsController]) -> None:
    rig, _, controller = there
    controller.power_up()
    recorder = GcsRecorder(controller, 200, 10e3, trigger="now")
    recorder.kickoff()
    controller.write(30.0)
    rig.wait(0.1)
    (chunk,) = recorder.finish()
    np.testing.assert_allclose(chunk.channels["V_mon"][1:], 30.0)
    assert controller.position() == pytest.approx(0.9e-6)


def test_line_cut(there: tuple[Rig, GcsFront, GcsController]) -> None:
    _, front, controller = there
    controller.power_up()
    front.faults.next(Fault(drop_after=1))
    with waits() as waited:
        with pytest.raises(LinkLost):
            controller.position()
        controller.close()
    assert waited.seconds < 20.0 * TIMEOUT
