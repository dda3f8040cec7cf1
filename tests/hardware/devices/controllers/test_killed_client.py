"""A client killed in the middle: only a watchdog in the device brings the output down."""

from __future__ import annotations

import subprocess
import sys

import pytest

from hardware.simulators.controllers import CommandWatchdog, GcsFront, GcsModel
from hardware.simulators.rig import Rig
from tests.hardware.devices.controllers.bench import Spring

# as small as it gets: the program is killed while it holds the output up
CLIENT = """
import socket, sys
link = socket.create_connection((sys.argv[1], int(sys.argv[2])))
link.sendall(b"SVA 1 60.0\\nERR?\\n")
assert link.recv(10) == b"0\\n"
print("up", flush=True)
link.recv(10)
"""


@pytest.mark.parametrize("watchdog", [None, CommandWatchdog(0.5, rate=500.0)])
def test_killed_client(watchdog: CommandWatchdog | None) -> None:
    rig = Rig(Spring())
    front = GcsFront(rig, model=GcsModel(watchdog=watchdog))
    host, _, port = front.start().rpartition(":")
    with subprocess.Popen(
        [sys.executable, "-I", "-S", "-c", CLIENT, host, port], stdout=subprocess.PIPE, text=True
    ) as client:
        assert client.stdout is not None
        assert client.stdout.readline() == "up\n"
        client.kill()
    assert rig.volts == 60.0
    rig.wait(0.4)
    assert rig.volts == 60.0
    rig.wait(1.0)
    assert rig.volts == (60.0 if watchdog is None else 0.0)
    front.stop()
