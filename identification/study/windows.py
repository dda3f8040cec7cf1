"""Stretches of a recording that are simulated from a state of their own."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from bondgraph.signals.split import Split, stretches


def windows_of(
    n: int, begin: int, breaks: Sequence[int], split: Split, length: int | None
) -> tuple[slice, ...]:
    """Return one window for each recording, or shorter ones that do not straddle the split.

    Parameters
    ----------
    n, begin : int
        Samples, and where the first window begins.
    breaks : sequence of int
        First samples of further recordings.
    length : int, optional
        About so many samples each; whole recordings without it.
    """
    if length is None:
        return tuple(slice(a, b) for a, b in pairwise((begin, *breaks, n)))
    found = []
    for part in (*stretches(split.train), *stretches(split.test)):
        first, last = part.start or 0, part.stop if part.stop is not None else n
        inner = [first, *(b for b in breaks if first < b < last), last]
        for start, stop in pairwise(inner):
            count = max(1, round((stop - start) / length))
            edges = np.linspace(start, stop, count + 1).astype(int)
            found += [slice(int(a), int(b)) for a, b in pairwise(edges) if b - a > 2]
    return tuple(sorted(found, key=lambda s: s.start))
