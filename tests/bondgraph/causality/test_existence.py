"""Whether a causality exists: against all strokes one by one, and how soon a refusal comes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from bondgraph import GY, TF, BondGraph, C, I, One, R, Se, Sf, Zero
from bondgraph.causality.assignment import CausalConflict, _imposed_strokes, assign_causality
from bondgraph.graph.bond_graph import Bond
from tests.counted import calls

SEEDS = range(300)


def tangle(seed: int) -> BondGraph:
    """Junctions in a random tree with a few more bonds, two-ports in some, ends at some."""
    rng = np.random.default_rng(seed)
    with BondGraph("tangle") as g:
        nodes = [(Zero, One)[int(rng.integers(2))](f"n{k}") for k in range(int(rng.integers(3, 6)))]
        pairs = [(int(rng.integers(k)), k) for k in range(1, len(nodes))]
        pairs += [(0, len(nodes) - 1), (1, 2)][: int(rng.integers(3))]
        for k, (i, j) in enumerate(dict.fromkeys(pairs)):
            way = rng.integers(4)
            a, b = nodes[i], nodes[j]
            if way == 0:
                a >> TF(f"t{k}", 2.0) >> b
            elif way == 1:
                a >> GY(f"g{k}", 2.0) >> b
            else:
                a >> b
        for k, node in enumerate(nodes):
            end = rng.integers(5)
            if end < 2:
                (Se if end else Sf)(f"s{k}") >> node
            elif end == 2:
                node >> R(f"r{k}", 1.0)
    return g


def strokes_exist(g: BondGraph) -> bool:
    """Try all strokes of all bonds."""
    for ends in product((0, 1), repeat=len(g.bonds)):
        to = {b: (b.tail, b.head)[end] for b, end in zip(g.bonds, ends, strict=True)}
        if all(_holds(g, n, to) for n in g.elements):
            return True
    return False


def _holds(g: BondGraph, name: str, to: dict[Bond, str]) -> bool:
    effort_in = [to[b] == name for b in g.bonds_of(name)]
    match g[name]:
        case Zero():
            return sum(effort_in) == 1
        case One():
            return sum(not e for e in effort_in) == 1
        case GY():
            return effort_in[0] == effort_in[1]
        case TF():
            return effort_in[0] != effort_in[1]
        case Se():
            return not effort_in[0]
        case Sf():
            return effort_in[0]
    return True


def test_a_matching_tells_what_all_strokes_tell() -> None:
    said = []
    for seed in SEEDS:
        g = tangle(seed)
        if g.check() or len(g.bonds) > 11:
            continue
        try:
            answer = _imposed_strokes(g, ()).completable()
        except CausalConflict:
            answer = False
        assert answer == strokes_exist(g), seed
        said.append(answer)
    assert min(said.count(True), said.count(False)) > 40


def mesh(rows: int, columns: int) -> BondGraph:
    """A chessboard of junctions less one corner: one colour is left over, far from every choice."""
    with BondGraph("mesh") as g:
        cells = {
            (i, j): (One if (i + j) % 2 else Zero)(f"n{i}_{j}")
            for i in range(rows)
            for j in range(columns)
            if (i, j) != (rows - 1, columns - 1)
        }
        for (i, j), node in cells.items():
            for beside in ((i + 1, j), (i, j + 1)):
                if beside in cells:
                    node >> cells[beside]
        for k in range(0, columns, 2):
            held = One(f"s{k}")
            Sf(f"q{k}") >> held >> C(f"c{k}", 1.0)
            held >> cells[0, k]
    return g


def test_a_large_graph_without_a_causality_is_refused_at_once() -> None:
    g = mesh(6, 7)
    assert len(g.bonds) > 70

    def refused() -> None:
        with pytest.raises(CausalConflict, match="put a resistance, a compliance or an inertia"):
            assign_causality(g)

    refused()
    assert calls(refused) < 400_000  # millions, where every choice was taken back in turn


def test_one_that_has_a_causality_is_still_assigned() -> None:
    g = mesh(6, 8)
    with g:
        Se("F") >> g["n5_6"]
        g["n5_6"] >> I("m", 1.0)
    assert len(assign_causality(g).strokes) == len(g.bonds)
