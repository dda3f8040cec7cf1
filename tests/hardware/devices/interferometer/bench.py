"""A rig, the simulated interferometer before it, and the driver opened on the stub library."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Acquisition, Chunk
from hardware.devices.interferometer import Interferometer, VendorLibrary
from hardware.simulators.control.client import LocalClock
from hardware.simulators.plant_contract import PlantMotion
from hardware.simulators.rig import DeviceClock, Rig
from hardware.simulators.siosifm import Faults, InterferometerFront, build

GAIN = 1e-7
"""Displacement by voltage of the bench's plant (m/V)."""


class Follower:
    """A plant that follows its voltage at once."""

    step = 1e-4

    def advance(self, volts: NDArray[np.float64]) -> PlantMotion:
        return PlantMotion(GAIN * np.asarray(volts), np.zeros(len(volts)))


@dataclass(frozen=True, slots=True)
class Bench:
    """What stands together."""

    rig: Rig
    front: InterferometerFront
    device: Interferometer
    address: str

    @property
    def faults(self) -> Faults:
        """Faults of the device."""
        return self.front.faults

    def run(self, acquisition: Acquisition, seconds: float, step: float = 0.01) -> list[Chunk]:
        """Poll while time passes (s)."""
        chunks: list[Chunk] = []
        for _ in range(round(seconds / step)):
            self.rig.wait(step)
            chunks += acquisition.poll()
        return chunks


def has_gcc() -> bool:
    """Whether the stub can be built."""
    return shutil.which("gcc") is not None


@cache
def stub() -> Path:
    """Return the stub library, built once."""
    return build()


@contextmanager
def make_bench(
    clock: DeviceClock | None = None, *, zero: bool = True, keep: float = 5.0, **front: Any
) -> Iterator[Bench]:
    """Make a bench; `front` goes to `InterferometerFront`."""
    rig = Rig(Follower(), keep=keep)
    served = InterferometerFront(rig, clock, **front)
    address = served.start()
    try:
        with Interferometer(
            f"net:{address}", library=VendorLibrary(stub()), clock=LocalClock(rig)
        ) as device:
            if zero:
                device.zero()
            yield Bench(rig, served, device, address)
    finally:
        served.stop()


def joined(chunks: Sequence[Chunk], name: str) -> NDArray[np.float64]:
    """Return one channel of all chunks."""
    return np.concatenate([c.channels[name] for c in chunks])


def flags(chunks: Sequence[Chunk]) -> NDArray[np.uint16]:
    """Return the flags of all chunks."""
    return np.concatenate([c.flags for c in chunks])
