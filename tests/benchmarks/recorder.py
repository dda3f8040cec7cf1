"""What a take costs: journal, alignment, a whole take over the wire; growth with its length."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hardware.contracts import Chunk
from hardware.storage import Journal, open_journal

BLOCK = 32_768


def bench_recorder(say: Callable[[str], object]) -> None:
    """Print the cost of storing a block, of reading it, and of takes of growing length."""
    with tempfile.TemporaryDirectory() as folder:
        _storing(Path(folder), say)
        for samples in (1000, 2000, 4000):
            _take(Path(folder), samples, say)


def _storing(folder: Path, say: Callable[[str], object]) -> None:
    rng = np.random.default_rng(0)
    channels = {k: rng.standard_normal(BLOCK) for k in ("x", "sin", "cos")}
    units = {"x": "m", "sin": "1", "cos": "1"}
    times = []
    with Journal.create(folder / "block.journal", {"name": "bench"}) as journal:
        for n in range(20):
            begin = time.perf_counter()
            journal.append(Chunk("interferometer", n * BLOCK, channels, units))
            times.append(time.perf_counter() - begin)
    begin = time.perf_counter()
    open_journal(folder / "block.journal").read("interferometer")
    read = time.perf_counter() - begin
    say(
        f"block of {BLOCK} samples, 3 channels: stored in {1e3 * float(np.median(times)):.1f} ms "
        f"(limit 200 ms), 20 of them read in {1e3 * read:.0f} ms"
    )


def _take(folder: Path, samples: int, say: Callable[[str], object]) -> None:
    from hardware.recorder import TakePlan, record
    from hardware.simulators.bench_server import BenchServer
    from hardware.simulators.bench_server.config import config_from
    from hardware.station import open_station, settings_from
    from hardware.station.virtual import station_table, stub_library

    config = config_from({"plant": {"effect": "none", "seed": 1}})
    volts = 30.0 + 20.0 * np.sin(np.linspace(0.0, 12.0, samples))
    times: dict[str, float] = {}
    with BenchServer(config) as server:
        table: dict[str, Any] = station_table(server.addresses, config, stub_library())
        with open_station(settings_from(table)) as bench:
            for way in ("clock", "start"):
                plan = TakePlan(volts, 10e3, "bench", "clock" if way == "clock" else "start")
                begin = time.perf_counter()
                record(bench.station(plan), plan, folder / f"{way}{samples}")
                times[way] = time.perf_counter() - begin
    say(
        f"take of {samples:5d} samples over the wire, bench in the same process: "
        + ", ".join(
            f"{t:.2f} s ({1e3 * t / samples:.2f} ms a sample) by {w}" for w, t in times.items()
        )
    )
