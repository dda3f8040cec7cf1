"""Drawings read back from their SVG: no text, box, bond, arrow or stroke hides another's text."""

from __future__ import annotations

import itertools
import random
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import matplotlib
import pytest
import sympy as sp
from matplotlib.ft2font import FT2Font

from actuators.models.catalogue import MODELS
from bondgraph import GY, TF, BondGraph, C, De, Df, I, One, R, Se, Zero
from bondgraph.causality.assignment import Causality, Stroke
from bondgraph.drawing.layout import GraphLayout, layout
from bondgraph.drawing.readings import readings
from bondgraph.drawing.routing import route
from bondgraph.drawing.svg import svg
from bondgraph.graph.elements import MTF, RS, X0, X1, CField, MSe, MSf
from bondgraph.graph.modulation import displacement, effort, external, flow, port_variables
from bondgraph.graph.sensors import Sensor
from tests.counted import calls

Box = tuple[float, float, float, float]
Point = tuple[float, float]
NS = "{http://www.w3.org/2000/svg}"


def one_ports(dice: random.Random, count: int) -> Iterator[tuple[type[R | C | I], str]]:
    """Kinds and names, short and long."""
    for k in range(count):
        stem = dice.choice(("x", "spring", "resistance_of_winding"))
        yield dice.choice((R, C, I)), f"{stem}_{k}"


def random_graph(seed: int) -> BondGraph:
    """Ten to sixty elements: two-ports, fields, switches, signals; half of them with rings."""
    dice = random.Random(seed)
    size = 10 + 50 * (seed % 20) // 19
    rings = 0 if seed < 20 else 1 + seed % 6
    q1, q2 = port_variables("q", 2)
    with BondGraph(f"random_{seed}") as g:
        nodes: list[Zero | One | X0 | X1] = [One("node_0"), Zero("node_1")]
        _ = Se("drive", unit="V") >> nodes[0] >> nodes[1]
        springs: list[str] = []
        leaves = one_ports(dice, size)
        while len(g.elements) < size:
            at = dice.choice(nodes[-6:])
            k, n = dice.random(), len(g.elements)
            if k < 0.33 or n > size - 3:
                if n > size - 3 or k < 0.1:
                    kind, name = next(leaves)
                    _ = at >> kind(name, 1.0)
                    springs += [name] if kind is C else []
                else:
                    node = dice.choice((One, Zero, One, Zero, X0, X1))(f"node_{n}")
                    _ = at >> node
                    nodes.append(node)
            elif k < 0.43:
                node = dice.choice((One, Zero))(f"node_{n}")
                angle = displacement(dice.choice(springs)) if springs else flow("node_0")
                kind_of = dice.choice((TF, GY, MTF))
                middle = kind_of(f"ratio_{n}", sp.cos(angle) if kind_of is MTF else 2.0)
                _ = at >> middle >> node
                nodes.append(node)
            elif k < 0.46:
                node = Zero(f"node_{n}")
                _ = at >> CField(f"field_{n}", energy=q1**2 + q2**2)
                _ = node >> g[f"field_{n}"]
                nodes.append(node)
            elif k < 0.5 and isinstance(at, Zero | One):
                _ = at >> (De(f"e_{n}") if isinstance(at, Zero) else Df(f"f_{n}"))
            elif k < 0.53:
                _ = MSe(f"pump_{n}", value=effort("node_1") * external("valve")) >> at
            else:
                kind, name = next(leaves)
                _ = at >> kind(name, 1.0)
                springs += [name] if kind is C else []
        joined = {frozenset((b.tail, b.head)) for b in g.bonds}
        pairs = itertools.combinations(nodes, 2)
        free = [p for p in pairs if frozenset(q.name for q in p) not in joined]
        for a, b in dice.sample(free, min(rings, len(free))):
            _ = a >> b
    return g


def strokes_by_chance(graph: BondGraph, seed: int) -> Causality:
    """Strokes at either end of every power bond, some of them special: the worst for a drawing."""
    dice = random.Random(seed)
    power = [b for b in graph.bonds if not isinstance(graph[b.head], Sensor)]
    strokes = {b: Stroke(b, dice.choice((b.tail, b.head)), "chance") for b in power}
    stores = tuple(e.name for e in graph.of_type(C, I))
    return Causality(strokes, stores[::3], tuple(e.name for e in graph.of_type(R))[::2])


@cache
def planned(name: str | int) -> tuple[BondGraph, GraphLayout]:
    """Model of the catalogue or random graph, and its layout."""
    graph = MODELS[name]() if isinstance(name, str) else random_graph(name)
    return graph, layout(graph)


@cache
def drawn(name: str | int) -> tuple[BondGraph, str]:
    """Model of the catalogue or random graph, and its SVG."""
    if isinstance(name, str):
        graph = MODELS[name]()
        return graph, svg(graph, title=graph.name)
    graph = random_graph(name)
    return graph, svg(graph, causality=strokes_by_chance(graph, name), title=graph.name)


@cache
def advance(ch: str) -> float:
    """Advance over the font size in the widest usual font."""
    return _font().load_char(ord(ch)).linearHoriAdvance / 65536 / 100


@cache
def _font() -> FT2Font:
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    font = FT2Font(str(folder / "DejaVuSans-Bold.ttf"))
    font.set_size(100, 72)
    return font


def text_box(e: ET.Element) -> Box:
    """Extent of a text as a browser sets it."""
    x, y, size = (float(e.attrib[k]) for k in ("x", "y", "font-size"))
    half = size * sum(advance(ch) for ch in e.text or "") / 2
    assert e.get("text-anchor") == "middle"
    return (x - half, y - 0.76 * size, x + half, y + 0.2 * size)


def rectangle(e: ET.Element) -> Box:
    x, y, w, h = (float(e.attrib[k]) for k in ("x", "y", "width", "height"))
    return (x, y, x + w, y + h)


def corners(e: ET.Element) -> list[Point]:
    numbers = [tuple(map(float, p.split(","))) for p in e.attrib["points"].split()]
    return [(x, y) for x, y in numbers]


def overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def passes(a: Point, b: Point, box: Box) -> bool:
    """Whether a segment meets the inside of a box (Liang and Barsky)."""
    t0, t1 = 0.0, 1.0
    for p, d, low, high in (
        (a[0], b[0] - a[0], box[0], box[2]),
        (a[1], b[1] - a[1], box[1], box[3]),
    ):
        if abs(d) < 1e-12:
            if not low < p < high:
                return False
            continue
        s, t = sorted(((low - p) / d, (high - p) / d))
        t0, t1 = max(t0, s), min(t1, t)
    return t0 < t1


def labels_of(root: ET.Element) -> list[list[Box]]:
    """Boxes of each label: its texts and its rectangles."""
    return [
        [text_box(t) for t in g.iter(NS + "text")] + [rectangle(r) for r in g.iter(NS + "rect")]
        for g in root.iter(NS + "g")
        if g.get("class") == "element"
    ]


def lines_of(root: ET.Element) -> list[list[Point]]:
    """All bonds, half arrows, strokes, taps and signals."""
    return [
        corners(e)
        for g in root.iter(NS + "g")
        if g.get("class") in ("bond", "tap", "signal")
        for e in g
        if e.tag in (NS + "polyline", NS + "polygon")
    ]


NAMES: list[str | int] = [*MODELS, *range(40)]


@pytest.mark.sampled(every=4)
@pytest.mark.parametrize("name", NAMES)
def test_nothing_hides_a_label_in_the_svg(name: str | int) -> None:
    graph, text = drawn(name)
    root = ET.fromstring(text)
    labels, lines = labels_of(root), lines_of(root)
    assert len(labels) == len(graph.elements)
    assert len(lines) >= len(graph.bonds)
    for a, b in itertools.combinations(labels, 2):
        assert not any(overlap(p, q) for p in a for q in b)
    x, y, w, h = map(float, root.attrib["viewBox"].split())
    everything = [q for boxes in labels for q in boxes]
    for points in lines:
        assert all(x < p < x + w and y < q < y + h for p, q in points)
        for start, end in itertools.pairwise(points):
            assert not any(passes(start, end, q) for q in everything), (start, end)
    for q in everything:
        assert x < q[0] < q[2] < x + w
        assert y < q[1] < q[3] < y + h


@pytest.mark.sampled(every=4)
@pytest.mark.parametrize("name", NAMES)
def test_heading_and_legend_stand_clear(name: str | int) -> None:
    root = ET.fromstring(drawn(name)[1])
    x, y, w, h = map(float, root.attrib["viewBox"].split())
    (legend,) = (g for g in root.iter(NS + "g") if g.get("class") == "legend")
    texts = [text_box(t) for t in legend.iter(NS + "text")]
    for a, b in itertools.combinations(texts, 2):
        assert not overlap(a, b)
    for t in texts:
        assert x < t[0] < t[2] < x + w
        assert y < t[1] < t[3] < y + h
        for boxes in labels_of(root):
            assert not any(overlap(t, q) for q in boxes)
        for points in lines_of(root):
            assert not any(passes(a, b, t) for a, b in itertools.pairwise(points))


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", NAMES)
def test_nothing_overlaps_in_the_layout(name: str | int) -> None:
    graph, plan = planned(name)
    boxes = {n: [(r.x0, r.y0, r.x1, r.y1) for r in label.parts] for n, label in plan.labels.items()}
    placed = {
        n: [(a + x, b + y, c + x, d + y) for a, b, c, d in boxes[n]]
        for n, (x, y) in plan.anchors.items()
    }
    for m, n in itertools.combinations(placed, 2):
        assert not any(overlap(p, q) for p in placed[m] for q in placed[n]), (m, n)
    wires = [*plan.wires.items(), *plan.signals.items()]
    assert set(plan.wires) == set(graph.bonds)
    assert set(plan.signals) == set(readings(graph))
    for edge, points in wires:
        for a, b in itertools.pairwise(points):
            for n, rs in placed.items():
                assert not any(passes(a, b, q) for q in rs), (edge, n)


def followed(v: list[Point], w: list[Point]) -> float:
    """Length over which two polylines of level and upright lines lie on each other."""
    total = 0.0
    for (a, b), (c, d) in itertools.product(itertools.pairwise(v), itertools.pairwise(w)):
        for i, j in ((0, 1), (1, 0)):
            if max(a[j], b[j], c[j], d[j]) - min(a[j], b[j], c[j], d[j]) < 1.5:
                low = max(min(a[i], b[i]), min(c[i], d[i]))
                total += max(0.0, min(max(a[i], b[i]), max(c[i], d[i])) - low)
    return total


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", NAMES)
def test_no_wire_lies_on_another(name: str | int) -> None:
    plan = planned(name)[1]
    wires = [list(w) for w in (*plan.wires.values(), *plan.signals.values())]
    for v, w in itertools.combinations(wires, 2):
        assert followed(v, w) < 6.0, (v, w)


def test_trees_are_drawn_without_crossings_and_rings_with_few() -> None:
    crossings = {seed: planned(seed)[1].crossings for seed in range(40)}
    plain = [s for s in crossings if not readings(planned(s)[0]) and s < 20]
    assert len(plain) >= 3
    assert all(crossings[s] == 0 for s in plain)
    rest = [c for s, c in crossings.items() if s not in plain]
    assert sum(rest) / len(rest) < 8.0
    assert all(planned(name)[1].crossings == 0 for name in MODELS)


def chain(n: int) -> BondGraph:
    """Masses, springs and dampers: 6 n + 2 elements."""
    with BondGraph("chain") as g:
        tail: Se | Zero = Se("F", unit="N")
        for i in range(n):
            mass, node, between = One(f"v_{i}"), Zero(f"F_{i}"), One(f"w_{i}")
            _ = tail >> mass >> I(f"m_{i}", 1.0, unit="kg")
            _ = mass >> node >> between >> C(f"k_{i}", stiffness=1.0, unit="N/m")
            _ = between >> R(f"d_{i}", 1.0, unit="N*s/m")
            tail = node
        _ = tail >> R("end", 1.0, unit="N*s/m")
    return g


def test_a_long_chain_is_wrapped() -> None:
    graph = chain(20)
    assert len(graph.elements) == 122
    page = layout(graph).page
    assert 0.5 < page.width / page.height < 3.0
    assert page.width < 2000.0


def test_long_branches_are_wrapped() -> None:
    with BondGraph("fork") as g:
        rail = Zero("rail")
        _ = Se("V") >> One("line") >> rail
        for arm in "abc":
            tail: One | Zero = rail
            for i in range(20):
                link, node = One(f"{arm}_{i}"), Zero(f"{arm}_n{i}")
                _ = tail >> link >> node >> C(f"C_{arm}{i}", 1.0)
                tail = node
    page = layout(g).page
    assert 0.4 < page.width / page.height < 3.0


def test_work_grows_nearly_linearly() -> None:
    small, large = (calls(lambda n=n: layout(chain(n))) for n in (17, 83))  # type: ignore[misc]
    print(f"{small} and {large} calls")
    assert large < 8 * small  # five times the elements
    # sixty elements with rings and signals
    assert calls(lambda: layout(random_graph(39))) < 2_000_000


def test_signals_lead_from_where_they_are_read() -> None:
    with BondGraph("lever") as g:
        shaft = One("shaft")
        _ = Se("M", unit="N*m") >> shaft >> C("angle", stiffness=1.0, unit="N*m")
        load = One("load")
        arm = MTF("arm", 0.3 * sp.cos(displacement("angle")))
        _ = shaft >> arm >> load >> I("m", 1.0, unit="kg")
        _ = MSf("wind", value=flow("load") * external("gust") * effort("shaft>arm")) >> Zero("air")
        _ = g["air"] >> R("vane", 1.0)
    found = {(r.source, r.target): r.signals for r in readings(g)}
    assert found == {
        ("angle", "arm"): ("q_angle",),
        ("load", "wind"): ("f_load",),
        ("shaft", "wind"): ("e_shaft>arm",),
    }
    root = ET.fromstring(svg(g))
    signals = [e for e in root.iter(NS + "g") if e.get("class") == "signal"]
    assert len(signals) == 3
    titles = {e.findtext(NS + "title") for e in signals}
    assert "arm reads q_angle" in titles
    assert ">signal</text>" in svg(g)


def test_switches_show_their_position() -> None:
    with BondGraph("clutch") as g:
        _ = Se("V") >> X1("closed") >> R("R_1", 1.0)
        _ = g["closed"] >> X0("open", on=False) >> R("R_2", 1.0)
    text = svg(g)
    assert ">closed: on</text>" in text
    assert ">open: off</text>" in text
    assert text.count('stroke-dasharray="2 3"') == 1


def test_derivative_and_free_strokes_are_coloured_and_explained() -> None:
    with BondGraph("two") as g:
        body = One("body")
        _ = Se("F", unit="N") >> body >> I("m_1", 1.0, unit="kg")
        _ = body >> I("m_2", 1.0, unit="kg")
        node = Zero("node")
        _ = Se("V", unit="V") >> One("loop") >> node >> R("R_1", 1.0, unit="ohm")
        _ = g["loop"] >> R("R_2", 1.0, unit="ohm")
        _ = body >> GY("r", 1.0) >> g["loop"]
    text = svg(g)
    assert ">derivative causality</text>" in text
    root = ET.fromstring(text)
    strokes = [e for e in root.iter(NS + "polyline") if e.get("class") == "stroke"]
    assert [e.get("stroke") for e in strokes].count("#be123c") == 1
    titles = [e.findtext(NS + "title") or "" for e in root.iter(NS + "g")]
    assert any("integral causality of I m_1" in t for t in titles)


def test_resistor_with_heat_is_a_two_port_between_domains() -> None:
    with BondGraph("heater") as g:
        _ = Se("V", unit="V") >> One("loop") >> RS("wire", 2.0) >> Zero("warm")
        _ = g["warm"] >> C("heat", 3.0, unit="J/K")
        _ = g["warm"] >> R("loss", 1.0, unit="K/W")
        _ = g["loop"] >> I("L", 1.0, unit="H")
    text = svg(g)
    assert ">electrical</text>" in text
    assert ">thermal</text>" in text


def test_hostile_names_of_graphs_are_escaped() -> None:
    with BondGraph('<script>alert("x")</script>') as g:
        _ = Se("V", unit='V"><script>') >> One("loop") >> R("R_1", 1.0)
    for text in (svg(g), svg(g, title="</svg><script>"), g._repr_html_()):
        assert "<script" not in text
        ET.fromstring(text)
        assert "href" not in text
        assert "url(" not in text
        assert text.startswith("<svg")


def test_a_route_keeps_clear_of_a_wall_of_labels() -> None:
    graph = random_graph(5)
    plan = layout(graph)
    first, *_, last = plan.anchors
    path = route((first, last), plan.anchors, plan.boxes, list(plan.wires.values()), plan.page)
    foreign = [r for n, rs in plan.boxes.items() if n not in (first, last) for r in rs]
    for a, b in itertools.pairwise(path):
        assert not any(passes(a, b, (r.x0, r.y0, r.x1, r.y1)) for r in foreign)
