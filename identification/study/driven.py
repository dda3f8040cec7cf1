"""Inputs that say nothing: dead or constant channels, before anything is fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.binding import external_signals
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.study.factors import drives

STANDS = "nothing but the start says what it does; check the channel"
"""What is said of an input that stands still."""
SMOOTH = 0.5
"""Rms of the differences of samples over that of their values: 1.4 for white noise."""


def require_driven(graph: BondGraph, recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return a line for each input that is constant in all recordings, and for a lack of inputs.

    Raises
    ------
    UnusableInput
        All inputs are 0 throughout while a reading moves: a dead channel. A decay is no fault, but
        its model has no source.
    """
    names = [e.name for e in drives(graph) if all(e.name in r.channels for r in recordings)]
    still = {n: float(recordings[0][n][0]) for n in names
             if len({v for r in recordings for v in (r[n].min(), r[n].max())}) == 1}  # fmt: skip
    sensors = [e.name for e in graph.of_type(Sensor)]
    moved = [n for n in sensors if any(n in r.channels and _moves(r[n]) for r in recordings)]
    many = sum(r.n for r in recordings)
    outside = [n for n in external_signals(graph) if any(np.ptp(r[n]) > 0 for r in recordings
               if n in r.channels)]  # fmt: skip
    if names and len(still) == len(names) and not (any(still.values()) or outside) and moved:
        raise UnusableInput(
            f"{recordings[0].name}: input {', '.join(still)} is 0 in all {many} samples while "
            f"{', '.join(moved)} moves: check the channel (map=); if the motion is free on "
            "purpose, leave the source out of the model"
        )
    if not (drives(graph) or external_signals(graph)):
        unused = sorted({n for r in recordings for n in r.channels if n not in sensors})
        columns = f"; columns that are no reading: {', '.join(unused)}" if unused else ""
        return (f"{graph.name} has no source, so nothing but the start says what it does{columns}",)
    return tuple(
        f"input {n} is {v:.4g} in all {many} samples: {STANDS}"
        for n, v in still.items()
        if moved and (len(still) == len(names) or v)
    )


def _moves(values: Array) -> bool:
    x = values - values.mean()
    return bool(0.0 < np.sum(np.diff(x) ** 2) < SMOOTH**2 * np.sum(x**2))
