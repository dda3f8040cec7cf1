"""Connected pieces of a graph: a tree of junctions and two-ports, its main path, the leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import networkx as nx

from bondgraph.elements import Junction, Source, TwoPort
from bondgraph.graph import BondGraph


@dataclass(frozen=True)
class Component:
    """A connected piece of the graph.

    Attributes
    ----------
    tree : networkx.Graph
        Spanning tree of its junctions and two-ports.
    leaves : dict of str to list of str
        One-ports at each of them.
    spine : list of str
        Longest path of the tree from a node that has a source.
    """

    tree: nx.Graph
    leaves: dict[str, list[str]]
    spine: list[str]


def components(graph: BondGraph) -> list[Component]:
    """Return the pieces of `graph` in the order of its elements."""
    g: nx.Graph = nx.Graph(graph.network().to_undirected())
    order = {n: i for i, n in enumerate(graph.elements)}
    groups = [sorted(c, key=order.__getitem__) for c in nx.connected_components(g)]
    return [_component(graph, g, group) for group in sorted(groups, key=lambda c: order[c[0]])]


def _component(graph: BondGraph, g: nx.Graph, group: list[str]) -> Component:
    nodes = [
        n for n in group if isinstance(graph[n], Junction | TwoPort) or g.degree(n) > 1
    ] or group[:1]
    inner = set(nodes)
    near = {n: [m for m in g[n]] for n in group}
    leaves: dict[str, list[str]] = {n: [] for n in nodes}
    for n in group:
        if n not in inner:
            leaves[near[n][0]].append(n)
    fed = [n for n in nodes if any(isinstance(graph[m], Source) for m in leaves[n])] or nodes
    best: tuple[list[str], nx.Graph] = ([], nx.Graph())
    for start in fed:
        tree, path = _deep_tree(start, near, inner)
        if len(path) > len(best[0]):
            best = (path, tree)
    return Component(best[1], leaves, best[0])


def _deep_tree(
    start: str, near: Mapping[str, list[str]], inner: set[str]
) -> tuple[nx.Graph, list[str]]:
    """Depth-first spanning tree and its longest path from `start`."""
    tree: nx.Graph = nx.Graph()
    tree.add_node(start)
    parent: dict[str, str] = {}
    depth = {start: 0}
    stack = [(start, iter(near[start]))]
    while stack:
        n, rest = stack[-1]
        m = next((m for m in rest if m in inner and m not in depth), None)
        if m is None:
            stack.pop()
            continue
        parent[m], depth[m] = n, depth[n] + 1
        tree.add_edge(n, m)
        stack.append((m, iter(near[m])))
    path = [max(depth, key=lambda n: depth[n])]
    while path[-1] != start:
        path.append(parent[path[-1]])
    return tree, path[::-1]
