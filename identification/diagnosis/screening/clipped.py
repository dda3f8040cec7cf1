"""Readings whose range has ended: they sit at their largest or smallest number, noise and all."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.sensors import Sensor
from bondgraph.support.arrays import Array
from identification.diagnosis.screening.undoing import Mixup
from identification.estimation.single_record import Fit

RUN, RUNS = 3, 3
"""Samples in a row at one end of a reading's range, and how often that happens, to be clipped."""
PART = 0.005
"""Part of the samples that are clipped at least."""
NOISE = 1.5
"""Mean square over the floor that may be noise alone: then the model knows of the limit."""
NOISY = 2.0
"""Noise over the smallest step of the numbers from which it would move them anywhere else."""


def clipped(nominal: Fit) -> tuple[Mixup, ...]:
    """Return readings that are cut at an end of their range, where the model as it is misses it.

    Noise does not stand still: numbers that do, always at the same end, were cut after it came in.
    What is coarser than its noise may rest anywhere, and is no evidence.
    """
    found, data = [], nominal.problem.data
    if nominal.chi2("test") <= NOISE:
        return ()
    for c, name in enumerate(data.names):
        y = data.readings[:, c]
        levels = np.unique(y)
        if levels.size < 2 or data.floor[c] < NOISY * float(np.diff(levels).min()):
            continue
        count = {v: cut_samples(y == v) for v in (levels[0], levels[-1])}
        ends = {v: n for v, n in count.items() if n}
        if sum(ends.values()) >= PART * y.size:
            part = sum(ends.values()) / y.size
            sensor = nominal.problem.graph[name]
            unit = sensor.unit if isinstance(sensor, Sensor) else ""
            there = tuple(map(float, ends))
            found.append(Mixup("clipped", (name,), share=part, ends=there, said=unit))
    return tuple(found)


def cut_samples(there: Array) -> int:
    """Return how many samples lie in long runs, where there are several.

    Parameters
    ----------
    there : ndarray of bool, shape (N,)

    Examples
    --------
    >>> cut_samples(np.array([0, 1, 1, 1, 0, 1, 0, 1, 1, 1, 1, 0, 1, 1, 1], bool))
    10
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(int)))
    lengths = edges[1::2] - edges[::2]
    long = lengths[lengths >= RUN]
    return int(long.sum()) if long.size >= RUNS else 0
