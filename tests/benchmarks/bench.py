"""Seconds of what runs beside a real bench: clocks, phase, limits, journal, view, block, engine."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from hardware.contracts import Chunk
from hardware.devices.interferometer import Block
from hardware.ecosystem import BlockPlan, BlueskyBlock, BlueskyDisplacement, BlueskyVoltage
from hardware.envelope import P840_1, Capacitance, Dwell, Envelope, GuardedOutput, check_wave
from hardware.live import Gathering, LiveView
from hardware.optics import Demodulator
from hardware.storage import Journal
from hardware.synchrony import ClockWiring, align
from tests.benchmarks.bounds import Measured, best, judged
from tests.hardware.devices.interferometer.bench import make_bench
from tests.hardware.ecosystem.bench import Bench as EngineBench
from tests.hardware.envelope.device import TrueTime
from tests.hardware.envelope.test_guard import LIMITS
from tests.hardware.envelope.test_judgement import sine as wave_of
from tests.hardware.live.test_live import Hand, Terminal, samples
from tests.hardware.optics.test_quadrature import BENT, INDEX, LASER
from tests.hardware.synchrony.bench import record, sine
from tests.hardware.synchrony.test_thesis import CLOCK, KNOWN


class Free:
    """An output that costs nothing."""

    identity = None
    has_watchdog = False

    def power_up(self) -> None: ...

    def write(self, volts: float) -> None: ...

    def read(self) -> None: ...

    def close(self) -> None: ...


def clocks() -> Iterator[Measured]:
    """0.1 to 0.3 s alone."""
    for f in (2.0, 100.0):
        drive, sensor = record(sine(f), CLOCK)
        for words, wiring in (("known", KNOWN), ("unknown", ClockWiring())):
            seconds = best(lambda d=drive, s=sensor, w=wiring: align(d, s, w), 1)  # type: ignore[misc]
            yield Measured(f"alignment at {f:g} Hz, lag {words}", seconds, 2.0)


def phase() -> Measured:
    """A minute at 16 kHz in 600 chunks."""
    x = 2.45e-6 * (1.0 - np.cos(2.0 * np.pi * 10.0 * np.arange(1600) / 16000.0))
    u1, u2 = BENT.signals(4.0 * np.pi * INDEX * x / LASER)

    def stream() -> None:
        state = Demodulator(BENT, LASER, INDEX)
        for _ in range(600):
            _, state = state.feed(u1, u2)

    return Measured("960,000 samples of quadrature", best(stream, 2), 5.0)


def limits() -> Iterator[Measured]:
    """0.08 s for two judgements of a million samples; 3.5 us a command."""
    wave = wave_of(10.0, 100.0, 1e5, 1_000_000)
    table = Capacitance((-20.0, 0.0, 50.0, 100.0), (1e-6, 1.5e-6, 2e-6, 2.4e-6))
    e = Envelope(-20.0, 100.0, 1e5, i_max=0.2, capacitance=table, dwell=[Dwell(90.0, 10.0)])

    def judge() -> None:
        check_wave(e, wave, 1e5)
        check_wave(P840_1, wave, 1e5)

    both = best(judge, 2)
    yield Measured("a million samples judged twice", both, 1.0)
    raw: Any = Free()
    output = GuardedOutput(raw, LIMITS, TrueTime())
    output.power_up()

    def command() -> None:
        for k in range(400):
            output.set(5.0 * (k & 1))

    seconds = best(command)
    yield Measured("a guarded command", seconds / 400.0, 20e-6)


def storing(folder: Path) -> Measured:
    """Append a block of the interferometer."""
    n, units = 32768, {"x": "m", "V": "V", "i": "A"}
    values, first = np.random.default_rng(0).normal(size=n), iter(range(0, 100 * n, n))
    with Journal.create(folder / "a.journal", {}) as journal:
        seconds = best(
            lambda: journal.append(Chunk("s", next(first), dict.fromkeys(units, values), units))
        )
    return Measured("a block of 32768 stored", seconds, 0.05)


def view() -> Measured:
    """Refresh the live view with two chunks."""
    clock = Hand()
    g = Gathering("run", clock, {"sensor": 10**6, "output": 10**6}, rates={"sensor": 16000.0})
    shown, first = LiveView(Terminal(), every=0.0), iter(range(0, 10**6, 320))

    def refresh() -> None:
        k = next(first)
        clock.sleep(0.02)
        g.take(samples(k, 320))
        g.take(samples(k, 320, stream="output"))
        shown.show(g.state())

    return Measured("a refresh of the view", best(refresh, 60), 1e-3)


def block() -> Measured:
    """Read a full block of the simulated interferometer."""
    with make_bench() as bench:
        full = Block(bench.device, 32_768, 1_000_000.0, start=False, extras=("sin", "cos"))
        full.kickoff()
        bench.rig.wait(0.04)
        return Measured("a full block read", best(full.poll, 1), 0.2)


def engine() -> Iterator[Measured]:
    """Bluesky: four points with ramps of virtual time; ten events of 32768 samples."""
    plans: Any = import_module("bluesky.plans")
    engines: Any = import_module("bluesky.run_engine")
    run, bench = engines.RunEngine({}, context_managers=[]), EngineBench()
    voltage = BlueskyVoltage(bench.output, readback=True, clock=bench.clock)
    displacement, volts = BlueskyDisplacement(bench.sensor), [0.0, 25.0, 100.0, 50.0]
    seconds = best(lambda: run(plans.list_scan([displacement], voltage, volts)), 1)
    yield Measured("a point of a scan", seconds / 4.0, 0.5)
    one = EngineBench()
    taken = BlueskyBlock(
        one.make, {"x": "m"}, wave=one.wave, clock=one.clock, plan=BlockPlan(32768, 1e6)
    )
    yield Measured("an event of 32768", best(lambda: run(plans.count([taken], 10)), 1) / 10.0, 0.2)


def measured() -> Iterator[Measured]:
    """All of them."""
    yield from clocks()
    yield phase()
    yield from limits()
    with tempfile.TemporaryDirectory() as folder:
        yield storing(Path(folder))
    yield view()
    yield block()
    yield from engine()


def main() -> int:
    """Print; 1 beyond a bound."""
    return judged(measured())


if __name__ == "__main__":
    sys.exit(main())
