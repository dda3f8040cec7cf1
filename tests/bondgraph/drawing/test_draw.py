"""Drawings: no overlaps, strokes as assigned, marks, determinism."""

from __future__ import annotations

import itertools
import random
import xml.etree.ElementTree as ET

import pytest

from actuators import stack_bond_graph
from bondgraph import (
    GY,
    BondGraph,
    C,
    De,
    Df,
    I,
    One,
    R,
    Se,
    Sf,
    UnknownName,
    Zero,
    assign_causality,
)
from bondgraph.drawing.layout import layout
from bondgraph.drawing.svg import svg


def chain(n: int) -> BondGraph:
    """Masses and springs: 4 n + 2 elements."""
    with BondGraph("chain") as g:
        tail: Se | Zero = Se("F_0", unit="N")
        for i in range(n):
            mass, spring = One(f"mass_{i}"), Zero(f"spring_{i}")
            _ = tail >> mass >> I(f"m_{i}", 1.0, unit="kg")
            _ = mass >> spring >> C(f"k_{i}", stiffness=1.0, unit="N/m")
            tail = spring
        _ = tail >> R("d_end", 1.0, unit="N*s/m")
    return g


def branching(n: int = 5) -> BondGraph:
    """Motors at one rail."""
    with BondGraph("branching") as g:
        rail = Zero("rail")
        _ = Se("supply", unit="V") >> One("cable") >> rail
        _ = g["cable"] >> R("R_cable", 0.1, unit="ohm")
        for i in range(n):
            coil, axis = One(f"coil_{i}"), One(f"axis_{i}")
            _ = rail >> coil >> GY(f"K_{i}", ratio=0.1) >> axis
            _ = coil >> R(f"R_{i}", 1.0, unit="ohm")
            _ = coil >> I(f"L_{i}", 1.0, unit="H")
            _ = coil >> Df(f"i_{i}", unit="A")
            _ = axis >> I(f"J_{i}", 1.0, unit="kg*m^2")
            _ = axis >> R(f"b_{i}", 1.0, unit="N*m*s")
            _ = axis >> C(f"k_{i}", stiffness=1.0, unit="N*m")
    return g


def ring() -> BondGraph:
    """Three nodes joined by three resistors."""
    with BondGraph("ring") as g:
        nodes = {n: Zero(f"node_{n}") for n in "abc"}
        _ = Sf("I_in", unit="A") >> nodes["a"]
        for p, q in ("ab", "bc", "ac"):
            arm = One(f"arm_{p}{q}")
            _ = nodes[p] >> arm >> nodes[q]
            _ = arm >> R(f"R_{p}{q}", 1.0, unit="ohm")
        for n, node in nodes.items():
            _ = node >> C(f"C_{n}", 1.0, unit="F")
        _ = nodes["b"] >> De("v_b", unit="V")
    return g


def star() -> BondGraph:
    """Many one-ports at one junction."""
    with BondGraph("star") as g:
        body = One("body")
        _ = Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        for i in range(11):
            _ = body >> R(f"damper_{i}", 1.0, unit="N*s/m")
    return g


def tree(seed: int, rings: int = 0) -> BondGraph:
    """Junctions in a random tree with random one-ports and so many bonds that close rings."""
    dice = random.Random(seed)
    with BondGraph(f"tree_{seed}_{rings}") as g:
        nodes: list[One | Zero] = []
        for i in range(14):
            node = dice.choice((One, Zero))(f"node_{i}")
            if nodes:
                _ = dice.choice(nodes) >> node
            nodes.append(node)
            for k in range(dice.randrange(4)):
                _ = node >> R(f"resistor_{i}_{k}", 1.0)
        joined = {frozenset((b.tail, b.head)) for b in g.bonds}
        free = [p for p in itertools.combinations(nodes, 2) if {q.name for q in p} not in joined]
        for a, b in dice.sample(free, rings):
            _ = a >> b
    return g


def conflict() -> BondGraph:
    """Two efforts at one junction."""
    with BondGraph("conflict") as g:
        node = Zero("node")
        _ = Se("V_1", unit="V") >> node
        _ = Se("V_2", unit="V") >> node
    return g


GRAPHS = (
    stack_bond_graph(sensors=("x", "i"), external_force=True),
    chain(15),
    branching(),
    branching(2),
    ring(),
    star(),
    conflict(),
    *(tree(seed) for seed in range(10)),
    *(tree(seed, rings=2) for seed in range(6)),
)


def crosses(a: tuple[float, float], b: tuple[float, float], box: tuple[float, ...]) -> bool:
    """Whether a segment passes through a box, by sampling."""
    if max(a[0], b[0]) <= box[0] or min(a[0], b[0]) >= box[2]:
        return False
    if max(a[1], b[1]) <= box[1] or min(a[1], b[1]) >= box[3]:
        return False
    for k in range(201):
        x, y = (p + (q - p) * k / 200 for p, q in zip(a, b, strict=True))
        if box[0] < x < box[2] and box[1] < y < box[3]:
            return True
    return False


def test_chain_has_sixty_elements() -> None:
    assert len(chain(15).elements) >= 60


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("graph", GRAPHS, ids=lambda g: g.name)
@pytest.mark.parametrize("marks", [False, True])
def test_no_labels_overlap(graph: BondGraph, marks: bool) -> None:
    captions = {n: "a long caption" for n in list(graph.elements)[::3]} if marks else {}
    plan = layout(graph, captions, captions)
    for (m, a), (n, b) in itertools.combinations(plan.boxes.items(), 2):
        assert not any(p.overlaps(q) for p in a for q in b), (m, n)
    assert set(plan.boxes) == set(graph.elements)
    assert set(plan.wires) == set(graph.bonds)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("graph", GRAPHS, ids=lambda g: g.name)
def test_no_bond_crosses_a_foreign_label(graph: BondGraph) -> None:
    plan = layout(graph)
    for bond, points in plan.wires.items():
        for n, boxes in plan.boxes.items():
            if n in (bond.tail, bond.head):
                continue
            for r, (a, b) in itertools.product(boxes, itertools.pairwise(points)):
                assert not crosses(a, b, (r.x0, r.y0, r.x1, r.y1)), (bond.name, n)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("graph", GRAPHS, ids=lambda g: g.name)
def test_bonds_are_long_enough_to_be_seen(graph: BondGraph) -> None:
    for points in layout(graph).wires.values():
        length = sum(
            ((q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2) ** 0.5 for p, q in itertools.pairwise(points)
        )
        assert length > 20.0


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("graph", GRAPHS, ids=lambda g: g.name)
def test_svg_is_well_formed_and_deterministic(graph: BondGraph) -> None:
    text = svg(graph)
    ET.fromstring(text)
    assert svg(graph) == text


def test_labels_strokes_and_taps() -> None:
    graph = stack_bond_graph(sensors=("x", "i"))
    text = svg(graph)
    for words in ("Se : V_in", "C : k", "TF : T_1", ">1</text>", ">polarisation</text>"):
        assert words in text
    assert text.count('class="stroke"') == len(assign_causality(graph).strokes)
    assert text.count('class="tap"') == 2


def test_stroke_stands_at_the_end_that_receives_the_effort() -> None:
    with BondGraph("lamp") as g:
        _ = Se("V", unit="V") >> One("loop") >> R("R_1", 5.0, unit="ohm")
    plan = layout(g)
    (first, _) = g.bonds
    strokes = [e for e in ET.fromstring(svg(g)).iter() if e.get("class") == "stroke"]
    xs = {float(p.split(",")[0]) for p in str(strokes[0].get("points")).split()}
    assert sorted(xs) == pytest.approx([plan.wires[first][-1][0]], abs=0.06)


def test_conflict_is_drawn_without_strokes() -> None:
    text = svg(conflict())
    assert 'class="stroke"' not in text
    assert "Se : V_2" in text


def test_marks() -> None:
    graph = stack_bond_graph()
    text = svg(graph, marked={"C_nl": "hysteresis <loop>"}, also=("k",), title="a & b")
    assert "hysteresis &lt;loop&gt;" in text
    assert "a &amp; b" in text
    assert text.count('stroke-dasharray="5 3"') == 1
    with pytest.raises(UnknownName, match="C_nl"):
        svg(graph, marked={"C_n": "hysteresis"})


def test_empty_and_lonely_graphs() -> None:
    with BondGraph("empty") as empty:
        pass
    ET.fromstring(svg(empty))
    with BondGraph("lonely") as lonely:
        R("R_1", 1.0)
        _ = Se("V") >> R("R_2", 1.0)
    assert "R : R_1" in svg(lonely)
