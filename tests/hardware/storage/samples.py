"""Chunks for the tests."""

import numpy as np

from hardware.contracts import Chunk, Flag


def chunk(stream="interferometer", first=0, n=8, flag=Flag.GOOD):
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


def expected_x(numbers):
    return np.sin(0.1 * np.asarray(numbers))
