"""What storing costs: calls for a block, memory for an hour."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np

from hardware.contracts import Chunk
from hardware.storage import Journal, open_journal
from tests.counted import calls
from tests.hardware.storage.samples import chunk


def test_a_block_costs_no_more_calls_than_a_sample(tmp_path: Path) -> None:
    units = {"x": "m", "V": "V", "i": "A"}
    sizes, first = (1, 1, 32768, 32768, 1), 0
    with Journal.create(tmp_path / "a.journal", {}) as journal:
        work = []
        for n in sizes:
            values = np.random.default_rng(0).normal(size=n)
            block = Chunk("s", first, dict.fromkeys(units, values), units)
            work.append(calls(lambda block=block: journal.append(block)))  # type: ignore[misc]
            first += n
    assert max(work[1:]) <= 1.2 * work[1] < 1000
    assert open_journal(tmp_path / "a.journal").read("s").n == sum(sizes)


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
