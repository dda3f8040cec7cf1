"""Strokes: every bond has one, with its reason; conflicts name the bonds."""

from __future__ import annotations

import pytest

from actuators import stack_bond_graph, stack_lumped
from actuators.models.catalogue import MODELS
from bondgraph import (
    GY,
    TF,
    BondGraph,
    C,
    CausalConflict,
    I,
    One,
    R,
    Se,
    Sf,
    Zero,
    assign_causality,
)
from bondgraph.graph.sensors import Sensor
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Coulomb, Hysteretic
from bondgraph.simulation.lure import compile_model


@pytest.mark.parametrize("name", MODELS)
def test_every_stroke_has_a_reason(name: str) -> None:
    graph = MODELS[name]()
    causality = assign_causality(graph)
    taps = {s.name for s in graph.of_type(Sensor)}
    powered = [b for b in graph.bonds if b.head not in taps]
    assert list(causality.strokes) == powered
    for bond, stroke in causality.strokes.items():
        assert stroke.reason
        assert {stroke.effort_to, stroke.flow_to} == {bond.tail, bond.head}
        assert bond.name in str(causality)


def test_junction_rules() -> None:
    """One bond sets the effort of a 0-junction, one the flow of a 1-junction."""
    graph = stack_bond_graph()
    strokes = assign_causality(graph).strokes
    for e in graph.of_type(Zero, One):
        at = [s for b, s in strokes.items() if e.name in (b.tail, b.head)]
        effort_in = sum(s.effort_to == e.name for s in at)
        assert effort_in == (1 if isinstance(e, Zero) else len(at) - 1)


@pytest.mark.parametrize(
    ("source", "junction", "bonds"),
    [(Se, Zero, ("S_1>j", "S_2>j")), (Sf, One, ("S_1>j", "S_2>j"))],
)
def test_two_sources_of_one_variable_conflict(source: type, junction: type, bonds: tuple) -> None:  # type: ignore[type-arg]
    with BondGraph("g") as g:
        j = junction("j")
        source("S_1") >> j
        source("S_2") >> j
        j >> R("R_1", 1.0)
    with pytest.raises(CausalConflict) as caught:
        assign_causality(g)
    for b in bonds:
        assert b in str(caught.value)
    assert "put a resistance" in str(caught.value)


def test_conflict_through_two_ports() -> None:
    """A gyrator turns one source into the other kind; a transformer does not."""

    def graph(two_port: TF | GY) -> BondGraph:
        with BondGraph("g") as g:
            a, b = Zero("a"), Zero("b")
            Se("S_1") >> a >> two_port >> b
            Se("S_2") >> b >> R("R_1", 1.0)
            a >> R("R_2", 1.0)
        return g

    with pytest.raises(CausalConflict, match="S_2"):
        assign_causality(graph(TF("n", ratio=2.0)))
    assert assign_causality(graph(GY("r", ratio=2.0))).derivative == ()


def test_free_choice_is_listed() -> None:
    with BondGraph("g") as g:
        a = One("a")
        Se("V") >> a >> R("R_1", 1.0)
        a >> R("R_2", 1.0)
    assert assign_causality(g).free_choices == ("R_1",)


def test_a_taken_back_choice_leaves_no_trace() -> None:
    """Five arms between four nodes: choices conflict and are taken back, and it ends well."""
    with BondGraph("bridge") as g:
        nodes = {n: Zero(n) for n in "abcd"}
        supply = One("supply")
        Se("V") >> supply >> nodes["a"]
        nodes["d"] >> supply
        for pair in ("ab", "ac", "bd", "cd", "bc"):
            arm = One(f"arm_{pair}")
            nodes[pair[0]] >> arm >> nodes[pair[1]]
            arm >> R(f"r_{pair}", 1.0)
    causality = assign_causality(g)
    assert len(causality.strokes) == len(g.bonds)
    for j in g.of_type(Zero):
        assert sum(causality.strokes[b].effort_to == j.name for b in g.bonds_of(j.name)) == 1


def test_friction_needs_the_flow() -> None:
    with BondGraph("g") as g:
        a = Zero("a")
        Se("V") >> a >> R("mu", 0.0, law=Coulomb())
    with pytest.raises(CausalConflict, match="its law gives effort from flow only"):
        assign_causality(g)


def test_derivative_causality_is_found() -> None:
    with BondGraph("g") as g:
        a = One("a")
        Se("F") >> a >> I("m_1", 1.0)
        a >> I("m_2", 1.0)
    assert assign_causality(g).derivative == ("m_2",)
    lumped = stack_lumped(Hysteretic(MaxwellResistiveCapacitor.stack_2hz()))
    assert assign_causality(lumped).derivative == ("H",)
    assert assign_causality(stack_lumped(resistance=1.0)).derivative == ()


def test_the_store_that_can_be_solved_gives_way() -> None:
    """A dependent inertia is refused, a dependent compliance solved: the inertia goes first."""
    with BondGraph("g") as g:
        a, b = One("a"), One("b")
        Se("F") >> a >> C("c", 1.0)
        a >> GY("r", ratio=2.0) >> b >> I("j", 1.0)
        b >> R("d", 1.0)
    assert assign_causality(g).derivative == ("c",)
    # z = p_j - r q_c, so c p_j' = r (F - r p_j / j) ... in displacements
    model = compile_model(g).model
    assert list(model.states) == ["z_p_j"]
