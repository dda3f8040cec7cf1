"""Marks on the samples that were cut to their limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Chunk, Flag, WaveProgress


def marked(written: WaveProgress, cut: NDArray[np.bool_]) -> WaveProgress:
    """Return the report with the samples flagged that were cut to the limits."""
    if not cut.any():
        return written
    return replace(written, chunks=_flagged(written.chunks, cut))


def _flagged(chunks: Sequence[Chunk], cut: NDArray[np.bool_]) -> tuple[Chunk, ...]:
    marked = []
    for chunk in chunks:
        flags = chunk.flags.copy()
        here = cut[chunk.first : chunk.first + chunk.n]
        flags[: here.size][here] |= np.uint16(Flag.CLAMPED)
        marked.append(replace(chunk, flags=flags))
    return tuple(marked)
