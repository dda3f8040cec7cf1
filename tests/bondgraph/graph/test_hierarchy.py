"""Graphs as elements of others: ports, names, bindings, cycles."""

from __future__ import annotations

import pytest
import sympy as sp

from bondgraph import (
    TF,
    BondGraph,
    C,
    De,
    Df,
    GraphError,
    I,
    One,
    R,
    Se,
    UnknownName,
    Zero,
)
from bondgraph.equations.derivation import equations
from bondgraph.graph.composing.components import COMPONENTS, rc_section
from bondgraph.graph.composing.hierarchy import Port, embedded, ports_of, use
from bondgraph.graph.composing.library import ComponentLibrary
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import MTF, CField, MSe
from bondgraph.graph.modulation import displacement, effort, external, port_variables
from bondgraph.laws import Polynomial
from tests.symbols import closed


def ladder() -> BondGraph:
    """Two RC sections behind a source, with a load."""
    section = rc_section(2.0, 3.0)
    with BondGraph("ladder") as g:
        first, second = use(section, "a"), use(section, "b", R=5.0)
        Se("V") >> first.left
        first.right >> second.port("left")
        second.right >> R("load", 7.0)
        second["node"] >> De("v")
    return g


def test_an_instance_is_flat_and_named_after_itself() -> None:
    g = ladder()
    assert g.check() == ()
    assert [e.name for e in g.of_type(R)] == ["a_R", "b_R", "load"]
    assert type(g["a_left"]) is One
    assert type(g["a_right"]) is Zero
    assert ports_of(g) == ()
    assert {n: p.value for n, p in g.parameters.items()} == {
        "a_R": 2.0, "a_C": 3.0, "b_R": 5.0, "b_C": 3.0, "load": 7.0,
    }  # fmt: skip


def test_the_equations_are_those_of_the_graph_written_out() -> None:
    with BondGraph("by_hand") as g:
        one, node_1, two, node_2 = One("one"), Zero("node_1"), One("two"), Zero("node_2")
        Se("V") >> one >> R("a_R", 2.0)
        one >> node_1 >> C("a_C", 3.0)
        node_1 >> two >> R("b_R", 5.0)
        two >> node_2 >> C("b_C", 3.0)
        node_2 >> R("load", 7.0)
        node_2 >> De("v")
    hand, made = closed(equations(g)), closed(equations(ladder()))
    assert made.x == hand.x
    assert sp.simplify(made.dxdt - hand.dxdt) == sp.zeros(2, 1)
    assert sp.simplify(made.y - hand.y) == sp.zeros(1, 1)


def test_nesting_goes_to_any_depth() -> None:
    with BondGraph("pair") as pair:
        a, b = use(rc_section(), "a"), use(rc_section(), "b")
        Port("left") >> a.left
        a.right >> b.left
        b.right >> Port("right")
    with BondGraph("four") as four:
        x, y = use(pair, "x"), use(pair, "y", b_R=9.0)
        Port("left") >> x.left
        x.right >> y.left
        y.right >> Port("right")
    with BondGraph("top") as top:
        z = use(four, "z")
        Se("V") >> z.left
        z.right >> R("load", 1.0)
    assert top.check() == ()
    assert top.parameters["z_y_b_R"].value == 9.0
    assert equations(top).order == 4


def test_parameters_are_renamed_overridden_shared_and_expressed() -> None:
    with BondGraph("spring") as sub:
        k = sub.parameter("k", 4.0, "N/m", spread=2.0)
        sub.parameter("tau", 0.1, "s")
        body = One("body")
        Port("end") >> body >> C("spring", stiffness=2 * k, unit="N/m")
        body >> R("d", 3.0, unit="N*s/m")
        Se("F", unit="N", drive=Drive(lag="tau")) >> body
        body >> TF("lever", ratio="k") >> R("d_2", 5.0)
        body >> I("m", 1.0)
    with BondGraph("outer") as g:
        stiff = g.parameter("K", 6.0, "N/m")
        common = g.parameter("T", 0.5, "s")
        tip = One("tip")
        Se("u") >> tip
        tip >> use(sub, "a").end
        tip >> use(sub, "b", k=8.0, d=2.0).end
        tip >> use(sub, "c", k="K", tau=common).end
        tip >> use(sub, "d", k=stiff / 2, d=3 * stiff).end
    p = g.parameters
    assert (p["a_k"].value, p["b_k"].value, p["b_d"].value) == (4.0, 8.0, 2.0)
    assert (p["a_k"].unit, p["a_k"].spread) == ("N/m", 2.0)
    assert not {"c_k", "d_k", "d_d", "c_tau"} & set(p)
    assert g.coefficient(g["a_spring"]) == 2 * p["a_k"].symbol
    assert g.coefficient(g["c_spring"]) == 2 * stiff
    assert g.coefficient(g["d_spring"]) == stiff
    assert g.coefficient(g["d_d"]) == 3 * stiff
    assert (g["a_lever"].ratio, g["c_lever"].ratio) == ("a_k", stiff)  # type: ignore[attr-defined]
    assert g["c_F"].drive.lag == "T"  # type: ignore[attr-defined]
    assert g["a_F"].drive.lag == "a_tau"  # type: ignore[attr-defined]
    assert g.check() == ()
    assert sub.parameters["k"].value == 4.0


def test_bindings_that_do_not_fit_are_refused_and_leave_the_graph_alone() -> None:
    with BondGraph("sub") as sub:
        sub.parameter("tau", 0.1, "s")
        body = One("body")
        Port("end") >> body >> C("k", stiffness=1.0, unit="N/m", law=Polynomial())
        Se("F", drive=Drive(lag="tau")) >> body
    with BondGraph("outer") as g:
        t = g.parameter("T", 1.0, "s")
        with pytest.raises(UnknownName, match="Did you mean 'tau'"):
            use(sub, "a", taw=1.0)
        with pytest.raises(UnknownName, match="no parameter 'TT'"):
            use(sub, "a", tau="TT")
        with pytest.raises(GraphError, match=r"sub.k is in N/m, but outer.T is in s"):
            use(sub, "a", k="T")
        with pytest.raises(GraphError, match="lag 'tau' cannot be the expression"):
            use(sub, "a", tau=2 * t)
        with pytest.raises(GraphError, match="a_2_k belongs to a law"):
            use(sub, "a", a_2_k=2.0)
        with pytest.raises(GraphError, match="give a number"):
            use(sub, "a", k=[1.0])
        with pytest.raises(GraphError, match="not an identifier"):
            use(sub, "2nd")
    assert list(g.elements) == []
    assert list(g.parameters) == ["T"]


def test_signals_laws_and_fields_follow_the_instance() -> None:
    q1, q2 = port_variables("q", 2)
    with BondGraph("sub") as sub:
        c = sub.parameter("c", 2.0)
        loop, node = One("loop"), Zero("node")
        Port("left") >> loop >> MTF("T", ratio=1 + displacement("k") * c) >> node
        node >> C("k", stiffness=1.0, law=Polynomial())
        MSe("M", value=effort("node") * external("u") + effort("loop>T")) >> loop
        loop >> CField("plate", law=(c * q1 - q2, q2 - q1))
        node >> sub["plate"]
    with BondGraph("outer") as g:
        a = use(sub, "a")
        use(sub, "b", in_u=effort("a_node"))
        Se("V") >> a.left
    assert str(g["a_T"].ratio) == "a_c*q_a_k + 1"  # type: ignore[attr-defined]
    assert str(g["a_M"].value) == "e_a_loop>a_T + e_a_node*in_a_u"  # type: ignore[attr-defined]
    assert str(g["b_M"].value) == "e_a_node*e_b_node + e_b_loop>b_T"  # type: ignore[attr-defined]
    assert g["a_plate"].law == (g.parameters["a_c"].symbol * q1 - q2, q2 - q1)  # type: ignore[attr-defined]
    assert "a_2_a_k" in g.parameters
    assert [b.tail for b in g.bonds_of("a_plate")] == ["a_loop", "a_node"]  # ports keep their order


@pytest.mark.parametrize("forward", [True, False])
def test_the_half_arrow_outside_may_have_either_direction(forward: bool) -> None:
    """Against the arrow inside, the junctions keep the balance: what leaves one side enters."""
    with BondGraph("g") as g:
        part = use(rc_section(2.0, 3.0), "a")
        node = Zero("node")
        Se("V") >> One("source") >> node
        if forward:
            node >> part.left
        else:
            part.left >> node
        part.right >> R("load", 1.0)
        part["loop"] >> Df("i")
    y = equations(g).outputs[0]
    volt, r = sp.Symbol("V", real=True), g.parameters["a_R"].symbol
    sign = 1 if forward else -1  # the effort of a 0-junction acts along the arrow
    assert sp.simplify(sp.diff(y, volt) - sign / r) == 0


def test_ports_left_open_or_badly_made_are_refused_by_name() -> None:
    with BondGraph("open") as g:
        part = use(rc_section(), "a")
        Se("V") >> part.left
    with pytest.raises(GraphError, match="a_right"):
        equations(g)
    with pytest.raises(GraphError, match="left"):
        equations(rc_section())
    with BondGraph("twice") as twice:
        port = Port("p")
        port >> R("R_1", 1.0)
        port >> R("R_2", 1.0)
    with BondGraph("never") as never:
        One("a") >> Zero("b")
        Port("p")
    with BondGraph("outer"):
        with pytest.raises(GraphError, match="port p has 2 bonds inside"):
            use(twice, "x")
        with pytest.raises(GraphError, match="port p has 0 bonds inside"):
            use(never, "x")
        a = use(rc_section(), "a")
        with pytest.raises(UnknownName, match="Did you mean 'left'"):
            a.port("lefft")
        with pytest.raises(AttributeError, match="no port 'rigth'; did you mean 'right'"):
            a.rigth
        with pytest.raises(UnknownName, match="no element 'RR' in a"):
            a["RR"]
    with pytest.raises(UnknownName, match="common variable"):
        Port("p", common="power")
    with pytest.raises(GraphError, match="outside of a graph"):
        use(rc_section(), "a")


def test_names_that_would_collide_are_refused() -> None:
    with BondGraph("g") as g:
        R("a_R", 1.0)
        g.parameter("b_C", 1.0)
        before = list(g.elements)
        for name in ("a", "b"):
            with pytest.raises(GraphError, match=f"second '{name}_"):
                use(rc_section(), name)
        assert list(g.elements) == before
        use(rc_section(), "c")
        with pytest.raises(GraphError, match="instance c would make a second"):
            use(rc_section(), "c")


def test_a_graph_that_uses_itself_is_refused_with_the_cycle() -> None:
    with BondGraph("a") as a:
        One("x") >> Port("p")
        with pytest.raises(GraphError, match="a uses itself: a -> a"):
            use(a, "again")
        with BondGraph("b"), BondGraph("c"):
            with pytest.raises(GraphError, match="a uses itself: a -> b -> c -> a"):
                use(a, "again")
    with BondGraph("d"), pytest.raises(GraphError, match="empty has no elements yet"):
        use(BondGraph("empty"), "e")


def test_a_library_refuses_components_made_of_themselves() -> None:
    def first() -> BondGraph:
        """Return one thing."""
        with BondGraph("first") as g:
            library.use("second", "s")
        return g

    def second() -> BondGraph:
        """Return another thing."""
        with BondGraph("second") as g:
            library.use("first", "f")
        return g

    library = ComponentLibrary("loop").with_component(first).with_component(second)
    with pytest.raises(GraphError, match="first is made of itself: first -> second -> first"):
        library.make("first")
    # the guard is gone after the error, and honest components work
    assert COMPONENTS.make("rc_section").name == "rc_section"


def test_embedding_leaves_the_original_untouched() -> None:
    with BondGraph("outer") as outer:
        One("loop")
    made = embedded(outer, rc_section(), "a", R=4.0)
    assert list(outer.elements) == ["loop"]
    assert made.parameters["a_R"].value == 4.0
