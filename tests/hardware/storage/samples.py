"""Chunks and journals for the tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hardware.contracts import Chunk, Flag
from hardware.storage import Journal


def chunk(
    stream: str = "interferometer", first: int = 0, n: int = 8, flag: Flag = Flag.GOOD
) -> Chunk:
    numbers = np.arange(first, first + n)
    flags = np.zeros(n, np.uint16)
    if flag:
        flags[n // 2] = flag
    return Chunk(
        stream,
        first,
        {"x": np.sin(0.1 * numbers), "instant": numbers / 16000.0},
        {"x": "um", "instant": "s"},
        flags,
    )


def expected_x(numbers: ArrayLike) -> NDArray[np.float64]:
    return np.asarray(np.sin(0.1 * np.asarray(numbers)), np.float64)


def written(
    path: Path, chunks: Sequence[Chunk], notes: Sequence[Mapping[str, Any]] = (), close: bool = True
) -> Journal:
    """Make a journal."""
    journal = Journal.create(path, {"name": "run"}, sync=None)
    for c in chunks:
        journal.append(c)
    for note in notes:
        journal.note(note)
    if close:
        journal.close()
    return journal
