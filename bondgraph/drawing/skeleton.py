"""Connected pieces of a graph: a rooted tree of junctions and couplers, with leaves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import networkx as nx

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Junction, Source, TwoPort

_STARTS = 8


@dataclass(frozen=True)
class Component:
    """A connected piece of the graph.

    Attributes
    ----------
    root : str
        Where the main path begins: a node with a source, if there is one.
    children : dict of str to list of str
        Spanning tree of its junctions and couplers, the child with the longest path first.
    leaves : dict of str to list of str
        One-ports at each of them.
    """

    root: str
    children: Mapping[str, Sequence[str]]
    leaves: Mapping[str, Sequence[str]]

    def path(self, start: str) -> list[str]:
        """Longest path downwards from a node."""
        found = [start]
        while self.children[found[-1]]:
            found.append(self.children[found[-1]][0])
        return found


def components(graph: BondGraph) -> list[list[Component]]:
    """Return the pieces of `graph` in the order of its elements, each with variants of its tree.

    A piece without rings has one spanning tree; its variants differ in the root.
    """
    g: nx.Graph = nx.Graph(graph.network)
    order = {n: i for i, n in enumerate(graph.elements)}
    return [
        _variants(graph, g, sorted(c, key=order.__getitem__)) for c in nx.connected_components(g)
    ]


def _variants(graph: BondGraph, g: nx.Graph, group: list[str]) -> list[Component]:
    nodes = [
        n for n in group if isinstance(graph[n], Junction | TwoPort) or g.degree(n) > 1
    ] or group[:1]
    leaves: dict[str, list[str]] = {n: [] for n in nodes}
    for n in group:
        if n not in leaves:
            leaves[next(iter(g[n]))].append(n)

    def inner(near: Iterable[str]) -> list[str]:
        return [m for m in near if m in leaves]

    def turned(near: Iterable[str]) -> list[str]:
        return inner(near)[::-1]

    fed = [n for n in nodes if any(isinstance(graph[m], Source) for m in leaves[n])] or nodes
    ringed = sum(len(inner(g[n])) for n in nodes) // 2 >= len(nodes)
    found: list[tuple[int, Component]] = []
    for start in fed[:_STARTS]:
        for search, order in (
            product((nx.dfs_edges, nx.bfs_edges), (inner, turned))
            if ringed
            else ((nx.dfs_edges, inner),)
        ):
            edges = search(g, start, sort_neighbors=order)
            length, children = _by_height({start: "", **{n: up for up, n in edges}})
            found.append((length, Component(start, children, leaves)))
    longest = max(length for length, _ in found)
    if not ringed:
        return [next(c for length, c in found if length == longest)]
    return [c for _, c in sorted(found, key=lambda item: -item[0])]


def _by_height(parent: Mapping[str, str]) -> tuple[int, dict[str, list[str]]]:
    """Length of the longest path from the root, and children sorted by theirs."""
    children: dict[str, list[str]] = {n: [] for n in parent}
    height = dict.fromkeys(parent, 1)
    for n in reversed(list(parent)):
        up = parent[n]
        children[n].sort(key=lambda m: -height[m])
        if up:
            children[up].insert(0, n)
            height[up] = max(height[up], height[n] + 1)
    return max(height.values()), children
