"""Channels that a recording may command or read, and the factors on them."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Modulated, Source
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor


def drives(graph: BondGraph) -> tuple[Source, ...]:
    """Return the sources that a recording commands; modulated ones are driven by the model."""
    return tuple(s for s in graph.of_type(Source) if not isinstance(s, Modulated))


def gain_name(channel: str) -> str:
    """Return the name of the factor on a channel."""
    return f"gain_{channel}"


def with_gains(graph: BondGraph, gains: Sequence[Parameter]) -> BondGraph:
    """Return the graph with factors on its readings and commands, named by `gain_name`."""
    named = {p.name: p for p in gains}
    for e in (*drives(graph), *graph.of_type(Sensor)):
        if gain_name(e.name) in named:
            graph = graph.with_element(e.name, gain=gain_name(e.name))
    here = [p for n, p in named.items() if n.removeprefix("gain_") in graph.elements]
    return graph.with_parameters(here) if here else graph


def stated_gains(graph: BondGraph) -> dict[str, str]:
    """Return the numbers in factors of channels that are free within two bounds, by channel.

    How far such a calibration may be off is stated; what lies beyond is a finding.
    """
    known, found = graph.parameters, {}
    for e in (*drives(graph), *graph.of_type(Sensor)):
        gain = graph.channel_value(e, "gain")
        numbers = [known[str(s)] for s in gain.free_symbols] if gain is not None else []
        bounded = [p for p in numbers if not p.fixed and None not in (p.lower, p.upper)]
        if len(bounded) == 1:
            found[e.name] = bounded[0].name
    return found
