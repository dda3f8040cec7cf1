"""The language: building, names, `check`, rewriting."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from itertools import pairwise
from typing import cast

import joblib
import networkx as nx
import pytest
import sympy as sp

from actuators.models.textbook import resonator
from bondgraph import (
    TF,
    Bond,
    BondGraph,
    C,
    De,
    Df,
    Dq,
    GraphError,
    I,
    MSe,
    One,
    R,
    Se,
    Sf,
    UnknownName,
    Zero,
)
from bondgraph.equations.derivation import equations
from bondgraph.graph import building
from bondgraph.graph.drives import Drive
from bondgraph.graph.modulation import effort
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.laws import Saturation
from bondgraph.laws.law import Law
from tests.counted import calls


def test_a_chain_reads_from_left_to_right() -> None:
    with BondGraph("rc") as g:
        loop = One("loop")
        Se("V") >> loop >> R("R_1", 2.0)
        loop >> C("C_1", 3.0)
    assert [b.name for b in g.bonds] == ["V>loop", "loop>R_1", "loop>C_1"]
    assert g.check() == ()
    assert g.neighbour("R_1") == "loop"
    assert {n: q.value for n, q in g.parameters.items()} == {"R_1": 2.0, "C_1": 3.0}
    assert "3 bonds" in repr(g)
    assert g.network.number_of_edges() == 3


def test_elements_and_bonds_are_stored_in_a_networkx_graph() -> None:
    with BondGraph("rc") as g:
        node, loop = Zero("node"), One("loop")
        loop >> node >> C("C_1", 3.0)
        Se("V") >> loop >> R("R_1", 2.0)
    network = g.network
    assert (type(network), network.name) == (nx.DiGraph, "rc")
    assert dict(network.nodes(data="element")) == dict(g.elements)
    assert list(network) == ["node", "loop", "C_1", "V", "R_1"]
    edges = sorted(network.edges(data=True), key=lambda edge: edge[2]["number"])
    assert tuple(edge["bond"] for *_, edge in edges) == g.bonds
    assert [(tail, head) for tail, head, *_ in edges] == [(b.tail, b.head) for b in g.bonds]
    assert [b.name for b in g.bonds_of("loop")] == ["loop>node", "V>loop", "loop>R_1"]
    assert g.bonds_of("nothing") == ()
    g.bond(node, R("R_2", 1.0))  # the view shows what is stored, not a copy of it
    assert network.edges["node", "R_2"]["number"] == 4
    assert g.bonds[-1].name == "node>R_2"


def test_the_network_is_read_only() -> None:
    g = resonator()
    (first, *_) = g.bonds
    attempts: tuple[Callable[[nx.DiGraph], object], ...] = (
        lambda n: n.add_node("more"),
        lambda n: n.add_edge(first.head, first.tail),
        lambda n: n.remove_edge(first.tail, first.head),
        lambda n: n.remove_node(first.tail),
        lambda n: n.clear(),
    )
    before = dict(g.elements), g.bonds
    for attempt in attempts:
        with pytest.raises(nx.NetworkXError, match="Frozen"):
            attempt(g.network)
    assert (dict(g.elements), g.bonds) == before


def test_the_attributes_of_the_network_are_read_only() -> None:
    g = resonator()
    (first, *_) = g.bonds
    tail, head = first.tail, first.head
    attempts: tuple[Callable[[nx.DiGraph], object], ...] = (
        lambda n: nx.set_node_attributes(n, {tail: 1}, "element"),
        lambda n: nx.set_edge_attributes(n, 7, "number"),
        lambda n: n.nodes[tail].update(element=1),
        lambda n: n.nodes[tail].clear(),
        lambda n: n.edges[tail, head].__setitem__("number", 7),
        lambda n: n[tail][head].__setitem__("number", 7),
        lambda n: n.pred[head][tail].__setitem__("number", 7),
        lambda n: n.subgraph([tail]).nodes[tail].__setitem__("element", 1),
        lambda n: n.reverse(copy=False)[head][tail].__setitem__("number", 7),
        lambda n: n.to_undirected(as_view=True)[head][tail].__setitem__("number", 7),
        lambda n: n._adj[tail].pop(head),
    )
    before = dict(g.elements), g.copy().bonds
    for attempt in attempts:
        with pytest.raises((TypeError, AttributeError), match="ReadOnly"):
            attempt(g.network)
    g.network.graph["name"] = "other"
    assert g.network.name == g.name
    assert (dict(g.elements), g.copy().bonds) == before
    assert [edge["number"] for *_, edge in g.network.edges(data=True)] == [
        g.bonds.index(edge["bond"]) for *_, edge in g.network.edges(data=True)
    ]


@pytest.mark.parametrize(
    "copied",
    [
        nx.Graph,
        nx.DiGraph,
        nx.DiGraph.copy,
        nx.DiGraph.to_undirected,
        nx.DiGraph.reverse,
        copy.deepcopy,
        lambda n: nx.relabel_nodes(n, {"body": "mass"}),
        lambda n: n.subgraph(list(n)).copy(),
    ],
)
def test_a_copy_of_the_network_is_for_work(copied: Callable[[nx.DiGraph], nx.Graph]) -> None:
    g = resonator()
    made = copied(g.network)
    assert nx.is_isomorphic(nx.Graph(made), nx.Graph(g.network))
    before = dict(g.elements), g.copy().bonds
    nx.set_node_attributes(made, 1, "element")
    nx.set_edge_attributes(made, 7, "number")
    assert {*dict(made.nodes(data="element")).values()} == {1}
    assert {number for *_, number in made.edges(data="number")} == {7}
    assert (dict(g.elements), g.copy().bonds) == before
    assert sorted(number for *_, number in g.network.edges(data="number")) == [*range(len(g.bonds))]


def test_networkx_reads_the_network() -> None:
    g = resonator()
    network = g.network
    assert [*nx.weakly_connected_components(network)] == [set(g.elements)]
    assert nx.is_isomorphic(network, pickle.loads(pickle.dumps(network)))
    assert nx.is_directed_acyclic_graph(network)
    assert network.degree["body"] == len(g.bonds_of("body"))
    assert network.nodes["d"] == {"element": g["d"]}
    assert nx.to_numpy_array(network).sum() == len(g.bonds)


def test_the_network_is_made_in_constant_time() -> None:
    few, many = BondGraph("few"), BondGraph("many")
    for g, size in ((few, 10), (many, 1000)):
        for k in range(size):
            g.add(R(f"R_{k}", 1.0))
    assert calls(lambda: few.network) == calls(lambda: many.network)


def test_reading_while_a_graph_is_built() -> None:
    with BondGraph("g") as g:
        loop = One("loop")
        source = Se("V") >> loop
        assert [b.name for b in g.bonds_of("loop")] == ["V>loop"]
        assert (tuple(g.elements), len(g.bonds), source) == (("loop", "V"), 1, g["loop"])
        assert tuple(g.parameters) == ()
        loop >> R("R_1", "r")
        assert [b.name for b in g.bonds_of("loop")] == ["V>loop", "loop>R_1"]
        assert g.bonds_of("nothing") == ()
        g.parameter("r", 1.0)
        loop >> R("R_2", 2.0)
    assert tuple(g.parameters) == ("r", "R_2")
    g.parameters.clear()
    assert tuple(g.parameters) == ("r", "R_2")


def _built_and_read(size: int, read: Callable[[BondGraph, str], object]) -> None:
    g = BondGraph("chain")
    last: One | Zero = One("j0")
    g.add(last)
    for k in range(size):
        following = Zero(f"j{k + 1}") if k % 2 == 0 else One(f"j{k + 1}")
        g.bond(last, following)
        read(g, last.name)
        last = following


@pytest.mark.parametrize(
    "read",
    [
        lambda g, _: g.bonds[-1],
        lambda g, _: repr(g),
        lambda g, name: g.bonds_of(name),
        lambda g, name: (g.bonds, g.bonds_of(name), g.bonds_of("j0")),
    ],
)
def test_reading_between_additions_takes_linear_work(
    read: Callable[[BondGraph, str], object],
) -> None:
    few = calls(lambda: _built_and_read(100, read))
    many = calls(lambda: _built_and_read(400, read))
    assert many < 4 * 1.3 * few


def test_a_graph_is_built_by_one_block_at_a_time() -> None:
    with BondGraph("outer") as outer, BondGraph("g") as g:
        One("loop")
        with pytest.raises(GraphError, match="g: the graph is being built already"), g:
            pass
        with pytest.raises(GraphError, match="outer: the graph is being built already"), outer:
            pass
        assert building.current() == (outer, g)
    assert building.current() == ()
    with g:  # one block after another is fine
        Zero("node")
    assert tuple(g.elements) == ("loop", "node")


def test_what_is_derived_from_another_graph_does_not_join_the_open_one() -> None:
    with BondGraph("sub") as part:
        loop = One("loop")
        Se("V", gain=2.0) >> loop >> C("c", stiffness=1.0)
        MSe("back", value=-effort("loop>c")) >> loop
    (bond,), inner = part.bonds_of("c"), One("inner")
    with BondGraph("outer") as outer:
        part.with_values({"c": 5.0, "gain_V": 3.0})
        part.with_element("c", stiffness=2.0).with_inserted(bond, inner)
    assert not outer.elements


def test_a_graph_copied_while_it_is_built_is_not_being_built() -> None:
    with BondGraph("g") as g:
        One("loop")
        made = copy.copy(g), copy.deepcopy(g), pickle.loads(pickle.dumps(g))
        for other in made:
            with other:
                Zero("node")
            assert tuple(other.elements) == ("loop", "node")
    assert tuple(g.elements) == ("loop",)


def test_only_an_element_with_one_bond_has_a_neighbour() -> None:
    g = resonator()
    with pytest.raises(GraphError, match=r"body has \d bonds, so it has no one neighbour"):
        g.neighbour("body")
    g.add(R("loose", 1.0))
    with pytest.raises(GraphError, match="loose has 0 bonds"):
        g.neighbour("loose")
    with pytest.raises(UnknownName, match="Did you mean 'body'"):
        g.neighbour("bdy")


def test_copies_are_independent_values() -> None:
    g = resonator()
    made: dict[str, BondGraph] = {
        "copy": g.copy("other"),
        "shallow": copy.copy(g),
        "deep": copy.deepcopy(g),
        "pickled": pickle.loads(pickle.dumps(g)),
    }
    for how, other in made.items():
        assert dict(other.elements) == dict(g.elements), how
        assert (other.bonds, other.parameters) == (g.bonds, g.parameters), how
        assert other.network.name == other.name, how
        other.bond(other["body"], R(f"R_{how}", 1.0))
        assert other.bonds_of("body")[-1].head == f"R_{how}"
        assert f"R_{how}" not in g.elements
    # a graph is itself only: equal content is compared by elements and bonds
    assert len({g, *made.values()}) == 5
    changed = g.with_element("d", value=7.0)
    assert changed.network.nodes["d"]["element"] == changed["d"] != g["d"]


def test_a_graph_can_be_sent_to_another_process() -> None:
    g = resonator()
    assert g.bonds  # what was derived from the network is not sent along
    assert g.bonds_of("body")
    state = g.__getstate__()
    assert (state["_read"], state["_at"]) == (None, {})
    (back,) = joblib.Parallel(n_jobs=2)([joblib.delayed(BondGraph.copy)(g, "back")])
    assert (back.name, dict(back.elements), back.bonds) == ("back", dict(g.elements), g.bonds)


def test_unknown_names_give_the_nearest() -> None:
    g = resonator()
    with pytest.raises(UnknownName, match="Did you mean 'body'"):
        g["bdy"]
    with pytest.raises(UnknownName, match="no parameter 'stiff'"):
        g.with_values({"stiff": 1.0})
    with BondGraph("g") as broken:
        broken.parameter("length", 1.0)
        One("a") >> TF("n", ratio="lenght") >> One("b")
    with pytest.raises(UnknownName, match="Did you mean 'length'"):
        broken.coefficient(broken["n"])


@pytest.mark.parametrize("text", ["80", "8e-3", " -2. "])
def test_a_number_in_quotes_is_no_name_of_a_parameter(text: str) -> None:
    with BondGraph("g") as g:
        Se("F") >> One("a") >> I("m", text)
    with pytest.raises(UnknownName, match=r"m in g: .* is text, .* give the number") as refused:
        g.coefficient(g["m"])
    assert f"number {text.strip()} without quotes" in str(refused.value)


def test_names_are_addresses() -> None:
    with pytest.raises(GraphError, match="not an identifier"):
        R("R 1", 1.0)
    with BondGraph("g") as g:
        a, b = One("a"), Zero("b")
        a >> b
        with pytest.raises(GraphError, match="two elements are called 'a'"):
            Zero("a")
        with pytest.raises(GraphError, match="bonded to itself"):
            a >> a
        with pytest.raises(GraphError, match="bonded twice"):
            b >> a
        g.parameter("l", 1.0)
        with pytest.raises(GraphError, match="declared twice"):
            g.parameter("l", 2.0)


def test_check_of_an_empty_graph() -> None:
    assert "no elements" in BondGraph("g").check()[0]


def problem(g: BondGraph, element: str, *words: str) -> None:
    """One line of `check` names the element and says what to do."""
    lines = [line for line in g.check() if line.startswith(element)]
    assert lines, g.check()
    for word in words:
        assert any(word in line for line in lines), (word, lines)
    with pytest.raises(GraphError, match=g.name):
        g.require_sound()


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: R("d", 3.0, law=cast("Law", "coulomb")), "d (R): law = 'coulomb' is no law"),
        (lambda: C("k", stiffness=3.0, law=cast("Law", "stop")), "k (C): law = 'stop'"),
        (lambda: I("m", 3.0, law=cast("Law", 7)), "m (I): law = 7"),
        (lambda: Dq("x", law=cast("Law", "bent")), "x (Dq): law = 'bent'"),
        (lambda: R("d", 3.0, law=cast("Law", Saturation)), "d (R): law = Saturation is no law"),
        (lambda: Se("u", drive=Drive(law=cast("Law", "flat"))), "u (Se): drive: law = 'flat'"),
        (lambda: Se("u", drive=cast("Drive", "flat")), "u (Se): drive = 'flat' is no Drive"),
    ],
)
def test_what_is_no_law_is_refused_where_it_is_given(make: Callable[[], object], said: str) -> None:
    with pytest.raises(GraphError) as refused:
        make()
    assert said in str(refused.value)


def test_what_cannot_be_measured_is_named() -> None:
    with BondGraph("inputs") as g:
        node = One("node")
        Se("given", measured=True, drive=Drive(delay="late")) >> node
        Se("bent", measured=True, drive=Drive(law=Saturation())) >> node
        MSe("computed", value=effort("b"), measured=True) >> node
        Se("typed", measured=cast("bool", "no")) >> node
        node >> I("m", 1.0)
        node >> R("b", 1.0)
        g.parameter("late", 0.0, "s", positive=False)
    problem(g, "bent", "no law of a drive", "leave out")
    problem(g, "computed", "signal of the model", "use Se or Sf")
    problem(g, "typed", "'no'", "True or False")
    assert not [line for line in g.check() if line.startswith("given")]


def test_each_kind_of_problem_names_element_and_remedy() -> None:
    with BondGraph("g") as g:
        a = One("a")
        Se("V") >> a >> R("R_1", 1.0)
        R("lost", 1.0)
        a >> C("negative", -1.0)
        a >> C("none")
        a >> I("zero", 0.0)
        a >> C("both", 1.0, stiffness=2.0)
        a >> De("meter")
        a >> TF("open_end", ratio=2.0)
        a >> Zero("dangling")
        a >> R("typo", "R_2")
        a >> R("nan", float("nan"))
        double = R("double", 1.0)
        a >> double
        One("b") >> double
    problem(g, "lost", "no bond", "connect it")
    problem(g, "negative", "creates energy", "positive")
    assert sum("negative" in line for line in g.check()) == 1
    problem(g, "zero", "coefficient is zero", "remove")
    problem(g, "both", "capacitance and a stiffness", "give one")
    problem(g, "meter", "attach it to a 0-junction")
    problem(g, "open_end", "two-port has two")
    problem(g, "dangling", "joins at least two")
    problem(g, "double", "has 2 bonds", "put a junction between")
    lines = " | ".join(g.check())
    assert "none has neither a value nor a law" in lines
    assert "no parameter 'R_2'" in lines
    assert "nan" in lines
    assert "finite" in lines


def test_half_arrows_may_point_either_way() -> None:
    """The law of an element holds for the flow into it; a load takes the arrow of its junction."""
    rates = []
    for outward in (False, True):
        with BondGraph("g") as g:
            node = Zero("node")
            Sf("F") >> node
            for e in (C("c", 2.0), R("r", 4.0)):
                _ = e >> node if outward else node >> e
        rates.append(equations(g).rates[0])
    F, c, r, q = (symbol(n, positive=n in "cr") for n in ("F", "c", "r", "q_c"))
    for rate in rates:
        assert sp.simplify(rate - (F - q / (c * r))) == 0
    with BondGraph("load") as g:
        body = One("body")
        Se("M") >> body >> Se("load")
        body >> I("J", 2.0)
    assert equations(g).rates[0] == symbol("M") - symbol("load")


def test_two_port_arrows_and_parts() -> None:
    with BondGraph("g") as g:
        a, b, n = One("a"), One("b"), TF("n", ratio=2.0)
        a >> n
        b >> n
        Se("V") >> a
        Se("W") >> b
        c, d = One("c"), R("R_1", 1.0)
        Se("U") >> c >> d
    problem(g, "n", "both half arrows point in", "a >> two_port >> b")
    problem(g, "the graph falls into 2 parts", "R_1, U, c", "bond them")


def test_two_one_ports_may_be_bonded_directly() -> None:
    with BondGraph("g") as g:
        R("R_1", 3.0) >> C("C_1", 2.0)
    (rate,) = equations(g).rates
    q, r, c = symbol("q_C_1"), symbol("R_1", positive=True), symbol("C_1", positive=True)
    assert sp.simplify(rate + q / (r * c)) == 0


def test_element_and_parameter_of_one_name() -> None:
    with BondGraph("g") as g:
        g.parameter("k", 2.0)
        body = One("body")
        Se("F") >> body >> C("k", stiffness=3.0)
    with pytest.raises(GraphError, match="'k' is both"):
        g.parameters


def test_negative_parameter() -> None:
    g = resonator().with_parameters([Parameter("l", -1.0, "m")])
    assert any("parameter l = -1 must be positive" in line for line in g.check())


def test_values_may_be_expressions() -> None:
    with BondGraph("g") as g:
        length = g.parameter("length", 2.0)
        body = One("body")
        Se("F") >> body >> I("m", 3.0 * length**2)
        body >> R("b", "length")
    assert g.coefficient(g["m"]) == 3.0 * length**2
    assert g.coefficient(g["b"]) == length
    assert g.with_values({"length": 5.0}).parameters["length"].value == 5.0


def test_rewriting_returns_new_graphs() -> None:
    g = resonator()
    heavier = g.with_values({"m": 1.0})
    assert (g.parameters["m"].value, heavier.parameters["m"].value) == (4e-6, 1.0)
    assert g.with_element("d", value=7.0).parameters["d"].value == 7.0
    grown = g.with_branch("body", [TF("n", ratio=2.0), One("far"), I("m_2", 1.0)])
    assert grown.elements.keys() - g.elements.keys() == {"n", "far", "m_2"}
    bond = g.bonds_of("k")[0]
    split = g.with_inserted(bond, Zero("joint"))
    assert [b.name for b in split.bonds_of("joint")] == ["body>joint", "joint>k"]
    assert g.bonds_of("k") == (bond,)
    i = g.bonds.index(bond)
    new = tuple(Bond(*ends) for ends in pairwise(("body", "joint", "k")))
    assert split.bonds == (*g.bonds[:i], *new, *g.bonds[i + 1 :])
    assert (*split.elements,) == (*g.elements, "joint")
    with pytest.raises(GraphError, match="no bond"):
        g.with_inserted(Bond("k", "m"), Zero("joint"))
    with pytest.raises(GraphError, match="has no value"):
        g.with_values({"body": 1.0})


def test_sensors_take_no_power() -> None:
    with BondGraph("g") as g:
        loop = One("loop")
        Se("V") >> loop >> R("R_1", 2.0)
        loop >> C("C_1", 1.0)
        loop >> Df("i")
    assert g.check() == ()
    assert sp.Symbol("R_1", positive=True) in g.coefficient(g["R_1"]).free_symbols


def test_what_is_derived_from_a_graph_is_kept_until_it_is_changed() -> None:
    made: list[int] = []

    def elements(graph: BondGraph) -> int:
        made.append(len(graph.elements))
        return made[-1]

    with BondGraph("g") as g:
        loop = One("loop")
        Se("V") >> loop >> R("R_1", 1.0)
    assert (g.kept(elements), g.kept(elements)) == (3, 3)
    assert made == [3]
    resistance, capacitor = R("R_2", 1.0), C("C_1", 1e-3)
    g.add(resistance)
    assert g.kept(elements) == 4
    assert any("R_2" in line for line in g.check())
    g.bond(loop, resistance)
    assert g.check() == ()
    g.bond(loop, capacitor)
    g.parameter("k", 2.0)
    assert g.kept(elements) == 5
    assert made == [3, 4, 5]
    assert g.with_values({"R_1": 3.0}).kept(elements) == 5
    assert pickle.loads(pickle.dumps(g)).kept(elements) == 5
    assert made == [3, 4, 5, 5, 5]


@pytest.mark.parametrize("drive", [Saturation(), "lag"])
def test_what_is_no_drive_is_refused_with_how_to_make_one(drive: object) -> None:
    with pytest.raises(GraphError, match=r"U \(Se\): drive = .*give Drive\(law="):
        Se("U", unit="V", drive=cast(Drive, drive))
