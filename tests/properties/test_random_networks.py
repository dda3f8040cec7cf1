"""The networkx graph that stores a random bond graph, and the algorithms that work on it."""

from __future__ import annotations

from itertools import combinations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph import Bond, BondGraph, GraphError, One
from bondgraph.drawing.skeleton import components as pieces
from bondgraph.equations.ordering import components
from bondgraph.graph.composing.renaming import assemble, declared_parameters
from bondgraph.graph.domain_check import groups_of_bonds
from bondgraph.graph.elements import Junction
from tests.properties.graphs import random_graph

quick = settings(max_examples=25, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)


def shuffled(seed: int) -> BondGraph:
    """A random graph with its bonds in another order: that of no walk over its elements."""
    g = random_graph(seed)
    rng = np.random.default_rng(seed)
    pairs = [(g.bonds[i].tail, g.bonds[i].head) for i in rng.permutation(len(g.bonds))]
    return assemble(g.name, g.elements.values(), pairs, declared_parameters(g))


@quick
@given(seeds)
def test_nodes_and_edges_are_elements_and_bonds_in_order(seed: int) -> None:
    g = shuffled(seed)
    assert list(g.network.nodes(data="element")) == list(g.elements.items())
    edges = sorted(g.network.edges(data=True), key=lambda edge: edge[2]["number"])
    assert [edge["number"] for *_, edge in edges] == list(range(len(g.bonds)))
    assert tuple(edge["bond"] for *_, edge in edges) == g.bonds
    assert tuple(Bond(tail, head) for tail, head, *_ in edges) == g.bonds
    for n in g.elements:
        assert g.bonds_of(n) == tuple(b for b in g.bonds if n in (b.tail, b.head))


@quick
@given(seeds)
def test_the_network_refuses_changes_and_second_bonds(seed: int) -> None:
    g = random_graph(seed)
    count = len(g.elements), len(g.bonds)
    first, second = list(g.elements)[:2]
    with pytest.raises(nx.NetworkXError, match="Frozen"):
        g.network.add_node("more")
    with pytest.raises(nx.NetworkXError, match="Frozen"):
        g.network.add_edge(first, second)
    for b in g.bonds:
        with pytest.raises(GraphError, match="bonded twice"):
            g.bond(g[b.head], g[b.tail])
    assert (len(g.elements), len(g.bonds)) == count
    assert g.copy().network.size() == g.network.size() == count[1]


@quick
@given(seeds)
def test_a_junction_put_into_a_bond_keeps_the_order_of_all_others(seed: int) -> None:
    g = shuffled(seed)
    i = seed % len(g.bonds)
    bond = g.bonds[i]
    split = g.with_inserted(bond, One("between"))
    halves = (Bond(bond.tail, "between"), Bond("between", bond.head))
    assert split.bonds == (*g.bonds[:i], *halves, *g.bonds[i + 1 :])
    assert tuple(split.elements) == (*g.elements, "between")


@quick
@given(seeds)
def test_parts_of_the_graph_are_found_by_name(seed: int) -> None:
    """Without some bonds: the count and the names are those of a search by hand."""
    g = random_graph(seed)
    rng = np.random.default_rng(seed)
    kept = [b for b in g.bonds if rng.random() < 0.8]
    cut = assemble(
        g.name, g.elements.values(), [(b.tail, b.head) for b in kept], declared_parameters(g)
    )
    part = {n: n for n in g.elements}
    for b in kept:
        old, new = part[b.tail], part[b.head]
        part = {n: new if p == old else p for n, p in part.items()}
    parts = [[n for n in part if part[n] == p] for p in dict.fromkeys(part.values())]
    largest = max(parts, key=len)
    said = [line for line in cut.check() if line.startswith("the graph falls")]
    if len(parts) == 1:
        assert said == []
    else:
        rest = ", ".join(sorted(n for n in part if n not in largest))
        assert said == [
            f"the graph falls into {len(parts)} parts: {rest} not connected to {min(largest)}; "
            "bond them"
        ]
    found = [
        sorted([*c[0].children, *(n for at in c[0].leaves.values() for n in at)])
        for c in pieces(cut)
    ]
    assert found == [sorted(p) for p in parts]


@quick
@given(seeds)
def test_bonds_share_a_group_if_junctions_join_them(seed: int) -> None:
    g = random_graph(seed)
    group = groups_of_bonds(g)
    joined = nx.Graph()
    joined.add_nodes_from(g.bonds)
    for e in g.of_type(Junction):
        joined.add_edges_from(combinations(g.bonds_of(e.name), 2))
    assert list(group) == list(g.bonds)
    found = {frozenset(b for b in g.bonds if group[b] == i) for i in group.values()}
    assert found == {frozenset(part) for part in nx.connected_components(joined)}


@quick
@given(seeds, st.integers(1, 12), st.floats(0.0, 0.5))
def test_order_of_evaluation_agrees_with_networkx(seed: int, size: int, share: float) -> None:
    """Parts and their order are those of networkx; inside, the order of its depth-first search."""
    rng = np.random.default_rng(seed)
    names = [f"s_{i}" for i in range(size)]
    reads = {n: [m for m in names if rng.random() < share] for n in names}
    graph = nx.DiGraph()
    graph.add_nodes_from(names)
    graph.add_edges_from((n, m) for n in names for m in reads[n])
    rank = {n: i for i, n in enumerate(nx.dfs_preorder_nodes(graph))}
    found = [sorted(p, key=rank.__getitem__) for p in nx.strongly_connected_components(graph)]
    assert components(names, reads.__getitem__) == found
