"""Which further sensor would let data determine more: every place is tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bondgraph.analysis.sensor_advice import fresh_sensor
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import One, Zero
from bondgraph.graph.sensors import De, Df, Dq, Sensor
from bondgraph.support.errors import BondsightError
from identification.uncertainty.structural import (
    StructuralIdentifiability,
    identifiability,
    structural_rank,
)


@dataclass(frozen=True, slots=True)
class SensorGain:
    """A further sensor and what it adds.

    Attributes
    ----------
    kind : {"De", "Df", "Dq"}
    junction : str
    added : int
        How many more numbers can be determined.
    missing : int
        How many are still missing then.
    """

    kind: str
    junction: str
    added: int
    missing: int

    def __str__(self) -> str:
        """One line."""
        left = "nothing is left open" if not self.missing else f"{self.missing} stay open"
        what = {"De": "effort", "Df": "flow", "Dq": "displacement"}[self.kind]
        return f"{self.kind} ({what}) at {self.junction}: +{self.added}, {left}"


def helpful_sensors(
    graph: BondGraph,
    free: Sequence[str] | None = None,
    known: StructuralIdentifiability | None = None,
) -> tuple[SensorGain, ...]:
    """Try a De at every 0-junction, a Df and, where the first helps, a Dq at every 1-junction.

    Parameters
    ----------
    graph : BondGraph
    free : sequence of str, optional
        As in `identifiability`.
    known : StructuralIdentifiability, optional
        Its answer, if it is there already.

    Returns
    -------
    tuple of SensorGain
        Those that add something, best first; at one place the flow stands for the displacement,
        which adds the same unless a rest position matters.
    """
    now = known or identifiability(graph, free)
    if not now.missing:
        return ()
    taken = {(type(s), graph.neighbour(s.name)) for s in graph.of_type(De, Df, Dq)}
    found = []
    for junction in graph.of_type(One, Zero):
        kinds: tuple[type[Sensor], ...] = (Df, Dq) if isinstance(junction, One) else (De,)
        for kind in kinds:
            if (kind, junction.name) in taken:
                continue
            try:
                wider = graph.with_branch(junction.name, [kind(fresh_sensor(graph, junction.name))])
                rank = structural_rank(wider, now.free)
            except BondsightError:
                continue
            if rank > now.rank:
                gain = SensorGain(kind.kind, junction.name, rank - now.rank, len(now.free) - rank)
                found.append(gain)
                break
    return tuple(sorted(found, key=lambda g: -g.added))
