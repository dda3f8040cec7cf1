"""A rig with a controller in front of it, on virtual time, and the two ways to talk to it."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from hardware.contracts import Clock
from hardware.devices.controllers import GatewayTransport, GcsController, GcsSetup, GcsTalk
from hardware.devices.transport import TcpTransport
from hardware.simulators.control.client import LocalClock
from hardware.simulators.controllers import GcsFront, GcsModel
from hardware.simulators.plant_contract import PlantMotion
from hardware.simulators.rig import DeviceClock, Rig

TIMEOUT = 0.08
WAYS = ("own", "pisocket")


class Spring:
    """30 nm/V at once; no current."""

    step = 1e-4

    def advance(self, volts: np.ndarray) -> PlantMotion:
        return PlantMotion(3e-8 * volts, np.full(volts.size, np.nan))


@dataclass
class Bench:
    rig: Rig
    front: GcsFront
    controller: GcsController
    clock: Clock

    @property
    def talk(self) -> GcsTalk:
        return self.controller.talk


def talk_to(address: str, way: str, timeout: float = TIMEOUT) -> GcsTalk:
    host, _, port = address.rpartition(":")
    if way == "own":
        return GcsTalk(TcpTransport(host, int(port), write_timeout=timeout), timeout)
    if importlib.util.find_spec("pipython") is None:
        pytest.skip("PIPython is not installed (pip install 'bondsight[bench]')")
    return GcsTalk(GatewayTransport.by_pisocket(host, int(port), write_timeout=timeout), timeout)


@contextmanager
def bench(
    way: str = "own",
    model: GcsModel | None = None,
    clock: DeviceClock | None = None,
    plant: Any = None,
    setup: GcsSetup | None = None,
    timeout: float = 2.0,
) -> Iterator[Bench]:
    rig = Rig(Spring() if plant is None else plant)
    front = GcsFront(rig, clock, model)
    address = front.start()
    program = LocalClock(rig)
    controller = GcsController(talk_to(address, way, timeout), setup, program)
    try:
        yield Bench(rig, front, controller, program)
    finally:
        controller.close()
        front.stop()
