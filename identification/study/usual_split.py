"""Which samples train and which judge where a study does not say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording, Split
from bondgraph.signals.split import default_split
from identification.study.factors import drives


def usual_splits(graph: BondGraph, recordings: Sequence[Recording]) -> tuple[Split, ...]:
    """Return the split of each recording by the usual rule."""
    return tuple(usual_split(graph, r) for r in recordings)


def usual_split(graph: BondGraph, recording: Recording) -> Split:
    """Return the split of a recording, a rest of the first command that moves left out."""
    here = [s.name for s in drives(graph) if s.name in recording.channels]
    moving = [n for n in here if np.ptp(recording[n]) > 0]
    watched = [*here, *(s.name for s in graph.of_type(Sensor) if s.name in recording.channels)]
    return default_split(recording, drive=moving[0] if moving else None, watched=watched)
