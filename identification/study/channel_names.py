"""What is said where a recording has no channel that is called as the model calls it."""

from __future__ import annotations

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.signals.recording import Recording
from bondgraph.signals.units import same_dimension

MOST_TOLD = 4
"""Columns whose units are said one by one."""


def rivals_for(unit: str, graph: BondGraph, recording: Recording) -> list[str]:
    """Return the channels of the dimension of a unit that no element of the graph is called by."""
    free = [n for n in recording.channels if unit and n not in graph.elements]
    return [n for n in free if same_dimension(recording.units[n], unit)]


def renamed(name: str, graph: BondGraph, recording: Recording) -> str:
    """Return how the only free channel in the unit of a source or sensor gets its name."""
    unit = getattr(graph.elements.get(name), "unit", "")
    free = rivals_for(unit, graph, recording)
    if len(free) != 1:
        return ""
    table = f"{{{name!r}: {free[0]!r}, '*': '*'}}"
    return f"{free[0]} is the only one in {unit}: give recording.select({table})"


def left_in(unit: str, graph: BondGraph, recording: Recording) -> str:
    """Return in which units the columns are that nothing of the graph is called by."""
    free = [n for n in recording.channels if n not in graph.elements]
    told = [f"{n} is in {recording.units[n]}" for n in free if recording.units[n]]
    if not unit or not told or len(told) > MOST_TOLD:
        return ""
    return f"; it is in {unit}, but of the columns that are left {', '.join(told)}"


def unread(recording: Recording) -> str:
    """Return which columns of its file a recording lacks, to be added to a line."""
    return f"; {why}" if (why := recording.meta.get("left_out", "")) else ""
