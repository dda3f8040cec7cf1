"""What storing costs: time for a block, memory for an hour."""

from __future__ import annotations

import time
import tracemalloc
from pathlib import Path

import numpy as np

from hardware.contracts import Chunk
from hardware.storage import Journal, open_journal
from tests.hardware.storage.samples import chunk


def test_a_block_is_stored_in_far_less_than_its_budget(tmp_path: Path) -> None:
    n = 32768
    values = np.random.default_rng(0).normal(size=n)
    units = {"x": "m", "V": "V", "i": "A"}
    with Journal.create(tmp_path / "a.journal", {}) as journal:
        times = []
        for k in range(5):
            block = Chunk("s", k * n, dict.fromkeys(units, values), units)
            start = time.perf_counter()
            journal.append(block)
            times.append(time.perf_counter() - start)
    assert min(times) < 0.05
    assert open_journal(tmp_path / "a.journal").read("s").n == 5 * n


def test_memory_does_not_grow_with_the_record(tmp_path: Path) -> None:
    parts = [chunk(first=320 * k, n=320) for k in range(2)]
    with Journal.create(tmp_path / "a.journal", {}, sync=None) as journal:
        journal.append(parts[0])
        tracemalloc.start()
        try:
            for _ in range(300):
                journal.append(parts[1])
                journal.note({"event": "tick"})
            _, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
    assert journal.size > 300 * 320 * 18
    # a few copies of one chunk
    assert peak < 10 * 320 * 18
