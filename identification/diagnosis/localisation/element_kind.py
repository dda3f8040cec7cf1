"""Kinds of places in the words of the verdict."""

from __future__ import annotations

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import GY, C, I, R, Source, TwoPort
from bondgraph.graph.sensors import Sensor


def element_kind(graph: BondGraph, name: str) -> str:
    """Kind of an element in the words of the verdict."""
    e = graph[name]
    for types, word in (
        (C, "storage"), (R, "resistor"), (I, "inertia"), (TwoPort, "transformer"),
        (Source, "source"), (Sensor, "sensor"),
    ):  # fmt: skip
        if isinstance(e, types):
            return word
    return "junction"


def element_words(graph: BondGraph, name: str) -> str:
    """Kind of an element as texts say it: the verdict has one word for every two-port."""
    return "gyrator" if isinstance(graph.elements.get(name), GY) else element_kind(graph, name)
