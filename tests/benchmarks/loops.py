"""How fast and how punctual a feedback loop is here: the runner alone, and over the wire."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import final

import numpy as np

from bondgraph.hysteresis import Ang
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Identity, WallClock
from hardware.envelope import Envelope, GuardedOutput, parked
from hardware.regulation import InverseLoop, LoopPlan, LoopStation, record_loop
from hardware.station import OpenStation, open_station

RATES = (500.0, 1e3, 2e3, 4e3, 8e3)


def bench_loops(say: Callable[[str], object]) -> None:
    """Print rate, jitter and limit of loops in real time."""
    with tempfile.TemporaryDirectory() as folder:
        say("PI and Ang's inverse, devices in memory, the computer's clock, journal on the disk")
        for rate in RATES:
            device = _Memory()
            output = GuardedOutput(device, Envelope(0.0, 100.0, 1e6, update_period=1e-4))
            station = LoopStation(
                WallClock(), output, device, 1e4, "the envelope", safety=parked(output)
            )
            _run(station, rate, Path(folder), say)
        say("the same over the wire of a virtual bench, a process beside, in real time")
        for rate in (50.0, 100.0, 200.0, 400.0):
            _over_the_wire(rate, Path(folder), say)


@final
class _Memory:
    """An actuator of 50 nm/V that is there at once, and its sensor."""

    identity = Identity("", "memory")
    has_watchdog = False
    stream, rate, done = "memory", 1e6, False

    def __init__(self) -> None:
        self.volts, self.count = 0.0, 0

    def power_up(self) -> None:
        self.volts = 0.0

    def write(self, volts: float) -> None:
        self.volts = volts

    def read(self) -> float | None:
        return None

    def close(self) -> None: ...

    def kickoff(self) -> None: ...

    def poll(self) -> Sequence[Chunk]:
        self.count += 1
        return [Chunk("memory", self.count - 1, {"x": np.array([50e-9 * self.volts])}, {"x": "m"})]

    def finish(self) -> Sequence[Chunk]:
        return []

    def abort(self) -> None: ...


def _run(station: LoopStation, rate: float, folder: Path, say: Callable[[str], object]) -> None:
    t = np.arange(round(rate)) / rate
    plan = LoopPlan(1e-6 * (1.0 - np.cos(2.0 * np.pi * t)), rate, name=f"{rate:g} Hz")
    controller = InverseLoop(Ang.stack_2hz(), 0.0, 0.3 * rate, rate)
    target = folder / f"loop{len(list(folder.iterdir()))}"
    try:
        timing = record_loop(station, plan, controller, target).timing
    except UnusableInput as refusal:
        say(f"  {str(refusal).splitlines()[0]}")
        return
    say(f"  {rate:g} Hz: " + "; ".join(s.split(": ", 1)[1] for s in timing.sentences[:3]))


def _over_the_wire(rate: float, folder: Path, say: Callable[[str], object]) -> None:
    from bondsight.cli.virtual_bench import served
    from hardware.simulators.bench_server.config import config_from

    config = config_from({"speed": 1.0, "plant": {"effect": "none", "seed": 5}})
    with served(config) as bench:
        opened: OpenStation = open_station(bench.settings)
        with opened as station:
            t = LoopPlan(np.zeros(2), rate)
            _run(station.loop(t), rate, folder, say)
