"""Graphs from graphs: replace, insert, remove, rename, simplify."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from actuators.stack.bond_graph import stack_bond_graph
from bondgraph import (
    GY,
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
    Sf,
    UnknownName,
    Zero,
)
from bondgraph.equations.derivation import equations
from bondgraph.graph.composing.components import rc_section
from bondgraph.graph.composing.hierarchy import use
from bondgraph.graph.composing.rewriting import insert, remove, rename, replace
from bondgraph.graph.composing.simplification import (
    collapse_junctions,
    merge_junctions,
    unused_parameters,
)
from bondgraph.graph.elements import MSe
from bondgraph.graph.modulation import displacement, effort, flow
from tests.settled import simulate
from tests.symbols import closed


def circuit() -> BondGraph:
    with BondGraph("rlc") as g:
        r = g.parameter("r", 2.0, "ohm")
        loop = One("loop")
        Se("V", unit="V") >> loop >> R("R_1", r, unit="ohm")
        loop >> I("L", 1.0, unit="H")
        loop >> C("C_1", 0.5, unit="F")
        loop >> Df("i", unit="A")
    return g


def text(g: BondGraph) -> tuple[object, ...]:
    return tuple(g.elements.values()), g.bonds, tuple(sorted(g.parameters))


def test_replacing_keeps_bonds_and_the_original() -> None:
    g = circuit()
    before = text(g)
    made = replace(g, "R_1", C("R_1", 3.0))
    assert made.bonds == g.bonds
    assert list(made.elements) == list(g.elements)
    assert isinstance(made["R_1"], C)
    assert text(g) == before
    assert equations(made).order == 3
    other = replace(g, "V", Se("source", unit="V"))
    assert other.bonds[0].name == "source>loop"
    gyrator = replace(stack_bond_graph(), "T_1", GY("T_1", ratio="l"))
    assert gyrator["T_1"].kind == "GY"


def test_a_replacement_that_breaks_the_graph_is_refused() -> None:
    g = circuit()
    with pytest.raises(GraphError, match=r"loop \(1\) cannot become a R: .*has 5 bonds"):
        replace(g, "loop", R("loop", 1.0))
    with pytest.raises(GraphError, match=r"cannot become a 0: i \(Df\) is bonded to loop"):
        replace(g, "loop", Zero("loop"))  # the sensor of a flow needs a 1-junction
    with pytest.raises(GraphError, match="there is a 'L' already"):
        replace(g, "R_1", R("L", 1.0))
    with pytest.raises(UnknownName, match="Did you mean 'R_1'"):
        replace(g, "R1", R("R_1", 1.0))
    with pytest.raises(GraphError, match="coefficient is zero"):
        replace(g, "L", I("L", 0.0))
    with BondGraph("read") as read:
        loop = One("loop")
        MSe("M", value=-displacement("C_1") * effort("C_1")) >> loop >> C("C_1", 1.0)
        loop >> R("R_2", 1.0)
    assert replace(read, "C_1", C("C_1", 2.0)).check() == ()
    with pytest.raises(GraphError, match="C_1 as R has no signal q_C_1, which M reads"):
        replace(read, "C_1", R("C_1", 2.0))


def test_insertion_into_a_bond_keeps_its_half_arrow() -> None:
    g = circuit()
    made = insert(g, "loop>C_1", [TF("n", ratio=2.0), Zero("node")])
    assert [b.name for b in made.bonds][3:6] == ["loop>n", "n>node", "node>C_1"]
    assert made.check() == ()
    backwards = insert(g, ("C_1", "loop"), [Zero("node"), TF("n", ratio=2.0)])
    assert {b.name for b in backwards.bonds} == {b.name for b in made.bonds}
    from_bond = insert(g, g.bonds[3], [TF("n", ratio=2.0), Zero("node")])
    assert text(from_bond) == text(made)
    # the effort of the capacitor comes back multiplied by the ratio
    twice = insert(g, "loop>C_1", [TF("n", ratio=2.0)])
    space = closed(equations(twice))
    x = {str(s): s for s in space.dxdt.free_symbols}
    rate = space.rates["p_L"]
    assert sp.simplify(sp.diff(rate, x["q_C_1"]) + x["n"] / x["C_1"]) == 0


def test_branches_point_away_unless_they_end_in_a_source() -> None:
    g = circuit()
    made = insert(g, "loop", [Zero("node"), R("leak", 5.0)])
    assert [b.name for b in made.bonds][-2:] == ["loop>node", "node>leak"]
    pushed = insert(g, "loop", Se("noise"))
    assert pushed.bonds[-1].name == "noise>loop"
    assert pushed.check() == ()


def test_insertions_that_make_no_sense_are_refused() -> None:
    g = circuit()
    for place, words in (("loop>R_2", "R_1"), ("lop", "loop")):
        with pytest.raises(UnknownName, match=f"Did you mean '{words}'"):
            insert(g, place, R("new", 1.0))
    with pytest.raises(GraphError, match="no bond joins R_1 and L; bonds at R_1: loop>R_1"):
        insert(g, ("R_1", "L"), One("new"))
    with pytest.raises(GraphError, match=r"cannot be inserted at loop>L: .*has 2 bonds"):
        insert(g, "loop>L", R("new", 1.0))
    with pytest.raises(GraphError, match="two-port has two"):
        insert(g, "loop", TF("new", ratio=2.0))
    with pytest.raises(GraphError, match="there is a 'r' already"):
        insert(g, "loop", R("r", 1.0))
    with pytest.raises(GraphError, match="nothing to insert"):
        insert(g, "loop", [])


def test_removal_undoes_insertion() -> None:
    g = circuit()
    assert text(remove(insert(g, "loop", R("R_2", 1.0)), "R_2")) == text(g)
    assert text(remove(insert(g, "loop>C_1", TF("n", ratio=2.0)), "n", bridge=True)) == text(g)


def test_removal_collapses_and_drops_what_is_left_over() -> None:
    with BondGraph("g") as g:
        g.parameter("r", 2.0)
        g.parameter("idle", 1.0)
        loop, node, last = One("loop"), Zero("node"), One("last")
        Se("V") >> loop >> R("R_1", 1.0)
        loop >> node >> last >> I("L", 1.0)
        node >> R("R_2", "r")
        last >> R("R_3", 1.0)
    made = remove(g, "R_2")
    assert "node" in made.elements
    assert "r" in made.parameters
    tidy = remove(g, "R_2", collapse=True, drop_parameters=True)
    assert "node" not in tidy.elements
    assert [b.name for b in tidy.bonds] == ["V>loop", "loop>R_1", "loop>last", "last>L", "last>R_3"]
    assert list(tidy.parameters) == ["idle", "R_1", "L", "R_3"]
    assert tidy.check() == ()
    assert [p.name for p in unused_parameters(tidy)] == ["idle"]
    with pytest.raises(GraphError, match="has 1 bonds in and 0 out"):
        remove(g, "R_2", bridge=True)
    with pytest.raises(UnknownName, match="Did you mean 'R_2'"):
        remove(g, "R2")


def test_what_an_expression_needs_cannot_be_removed() -> None:
    with BondGraph("g") as g:
        loop = One("loop")
        MSe("M", value=-2 * effort("C_1")) >> loop
        loop >> C("C_1", 1.0)
        r = R("R_1", 1.0)
        loop >> r
        loop >> R("R_2", 2 * g.parameters["R_1"].symbol)
    with pytest.raises(GraphError, match="C_1 is needed by the expression of M"):
        remove(g, "C_1")
    with pytest.raises(GraphError, match="R_1 is needed by the expression of R_2"):
        remove(g, "R_1")
    assert "R_2" not in remove(g, "R_2").elements


def test_renaming_follows_everywhere() -> None:
    with BondGraph("g") as g:
        k = g.parameter("k", 2.0)
        loop = One("loop")
        MSe("M", value=-k * effort("C_1") + flow("M>loop")) >> loop
        loop >> C("C_1", 1.0)
        loop >> R("R_1", 3.0)
        loop >> R("R_2", g.parameters["R_1"].symbol * k)
        loop >> R("R_3", "k")
    made = rename(rename(rename(g, "C_1", "store"), "R_1", "drag"), "k", "gain")
    made = rename(made, "loop", "ring")
    assert str(made["M"].value) == "-e_store*gain + f_M>ring"  # type: ignore[attr-defined]
    assert str(made["R_2"].value) == "drag*gain"  # type: ignore[attr-defined]
    assert made["R_3"].value == "gain"  # type: ignore[attr-defined]
    assert list(made.parameters) == ["gain", "store", "drag"]
    assert made.check() == ()
    assert g.parameters["k"].value == 2.0
    with pytest.raises(UnknownName, match="Did you mean 'loop'"):
        rename(g, "lop", "x")
    with pytest.raises(GraphError, match="there is a 'k' already"):
        rename(g, "C_1", "k")


def test_merging_keeps_the_equations() -> None:
    with BondGraph("ladder") as g:
        a, b = use(rc_section(1.0, 2.0), "a"), use(rc_section(3.0, 4.0), "b")
        Se("V") >> a.left
        a.right >> b.left
        b.right >> R("load", 5.0)
        b["node"] >> De("v")
    merged = merge_junctions(g)
    assert len(merged.elements) < len(g.elements)
    assert not [bond for bond in merged.bonds if type(merged[bond.tail]) is type(merged[bond.head])]
    old, new = closed(equations(g)), closed(equations(merged))
    assert old.x == new.x
    assert sp.simplify(old.dxdt - new.dxdt) == sp.zeros(2, 1)
    time = np.linspace(0, 5, 101)
    u = {"V": np.sin(time)}
    np.testing.assert_allclose(simulate(merged, time, u)["v"], simulate(g, time, u)["v"])


def test_merging_follows_expressions_and_leaves_what_it_cannot_do() -> None:
    with BondGraph("g") as g:
        a, b, c = One("a"), One("b"), Zero("c")
        MSe("M", value=flow("b")) >> a
        a >> b >> R("R_1", 1.0)
        b >> c >> C("C_1", 1.0)
    made = merge_junctions(g)
    assert str(made["M"].value) == "f_a"  # type: ignore[attr-defined]
    assert [x.name for x in made.bonds] == ["M>a", "a>R_1", "a>c", "c>C_1"]
    with BondGraph("ring") as ring:
        a, b, c = One("a"), One("b"), Zero("c")
        Se("V") >> a >> b >> c
        a >> c >> C("C_1", 1.0)
    assert {"a", "b"} <= set(merge_junctions(ring).elements)


def test_collapsing_leaves_what_is_needed() -> None:
    with BondGraph("g") as g:
        a, b, c = One("a"), Zero("b"), One("c")
        Sf("J") >> b >> a >> c >> TF("n", ratio=2.0) >> R("R_1", 1.0)
        a >> Df("i")
    assert [x.name for x in collapse_junctions(g).bonds] == ["J>a", "a>n", "n>R_1", "a>i"]
    assert [x.name for x in collapse_junctions(g, ["c"]).bonds][2] == "a>n"
    with BondGraph("two") as two:
        Se("V") >> One("only") >> R("R_1", 1.0)
    assert "only" in collapse_junctions(two).elements
