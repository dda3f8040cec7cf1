"""How fast values come through: the driver against the stub library and the simulated device."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from hardware.devices.interferometer.block import Block
from hardware.devices.interferometer.constants import BLOCK_MEMORY
from hardware.devices.interferometer.device import Interferometer
from hardware.devices.interferometer.pump import compiled
from hardware.devices.interferometer.streaming import NORMAL_RATE, Streaming
from hardware.simulators.control.client import LocalClock
from hardware.simulators.rig import Rig
from hardware.simulators.siosifm import InterferometerFront, build
from tests.hardware.devices.interferometer.bench import Follower

_POLL = 0.02


@dataclass(frozen=True, slots=True)
class StreamFigures:
    """A stream on virtual time, as fast as it goes.

    Parameters
    ----------
    rate : float
        Rate of the device (Hz).
    samples, lost : int
        Handed out; missing.
    largest_chunk : int
        Samples of the largest poll: what memory must hold.
    seconds : float
        Real time taken (s).
    growth : float
        Growth of the largest resident size of the process (MB); NaN where it is not known.
    """

    rate: float
    samples: int
    lost: int
    largest_chunk: int
    seconds: float
    growth: float

    @property
    def throughput(self) -> float:
        """Samples per second of real time."""
        return self.samples / self.seconds


@dataclass(frozen=True, slots=True)
class Figures:
    """What `measure` found.

    Parameters
    ----------
    block, block_by_hand : float
        Real time (s) to fetch a full block by the compiled loop and by the loop in Python.
    stream : StreamFigures
        Normal mode.
    fastest : StreamFigures
        At a rate beyond what comes through: its throughput is the largest sustained rate.
    native : bool
        Whether the compiled loop was there.
    """

    block: float
    block_by_hand: float
    stream: StreamFigures
    fastest: StreamFigures
    native: bool

    def lines(self) -> tuple[str, ...]:
        """Return the figures as text."""
        s, f = self.stream, self.fastest
        return (
            f"block of {BLOCK_MEMORY} samples: {1e3 * self.block:.1f} ms "
            f"({'compiled loop' if self.native else 'no compiler'}), "
            f"{1e3 * self.block_by_hand:.1f} ms by the loop in Python",
            f"stream of {s.samples} samples at {s.rate:g} Hz: {s.lost} lost, at most "
            f"{s.largest_chunk} samples at once, memory grew by {s.growth:.1f} MB, "
            f"{s.seconds:.2f} s of computing for {s.samples / s.rate:.0f} s of measuring",
            f"largest sustained rate: {f.throughput:.3g} Hz (driver and simulated device on one "
            "processor)",
        )


def measure(folder: str | Path | None = None, seconds: float = 60.0) -> Figures:
    """Measure against the simulated device, on virtual time.

    Parameters
    ----------
    folder : path, optional
        Where the stub library is built, by default the user's cache; needs gcc.
    seconds : float
        Length of the stream in normal mode (s).
    """
    with _bench(folder) as (rig, device):
        _block(rig, device, native=True)  # load and compile outside of the measured time
        return Figures(
            min(_block(rig, device, native=True) for _ in range(3)),
            _block(rig, device, native=False),
            stream(rig, device, NORMAL_RATE, seconds),
            stream(rig, device, 1e6, 4.0),
            compiled() is not None,
        )


@contextmanager
def _bench(folder: str | Path | None) -> Iterator[tuple[Rig, Interferometer]]:
    rig = Rig(Follower(), keep=2.0)
    front = InterferometerFront(rig, stream_limit=1e7)
    try:
        address = f"net:{front.start()}"
        with Interferometer(address, library=build(folder), clock=LocalClock(rig)) as device:
            device.zero()
            yield rig, device
    finally:
        front.stop()


def _block(rig: Rig, device: Interferometer, native: bool) -> float:
    """Return the real time (s) from the ready block to its chunks."""
    block = Block(device, BLOCK_MEMORY, 1e6, start=False, native=native)
    block.kickoff()
    rig.wait(0.05)
    begin = time.perf_counter()
    while not block.done:
        block.poll()
    taken = time.perf_counter() - begin
    block.finish()
    return taken


def stream(rig: Rig, device: Interferometer, rate: float, seconds: float) -> StreamFigures:
    """Stream for some virtual time (s) and count."""
    acquisition = Streaming(device, rate)
    acquisition.kickoff()
    samples = largest = last = 0
    before, begin = _resident(), time.perf_counter()
    for _ in range(round(seconds / _POLL)):
        rig.wait(_POLL)
        chunks = acquisition.poll()
        here = sum(c.n for c in chunks)
        samples, largest = samples + here, max(largest, here)
        last = chunks[-1].first + chunks[-1].n if chunks else last
    taken = time.perf_counter() - begin
    growth = _resident() - before
    acquisition.abort()
    return StreamFigures(acquisition.rate, samples, last - samples, largest, taken, growth)


def _resident() -> float:
    """Largest resident size of the process so far (MB)."""
    try:
        import resource
    except ImportError:
        return float("nan")
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return size / (1024.0**2 if sys.platform == "darwin" else 1024.0)
