"""What a law names beside its argument follows: renamed, put into another graph, taken apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, Df, I, One, R, Se, Zero
from bondgraph.graph.composing.hierarchy import Port, use
from bondgraph.graph.composing.rewriting import rename
from bondgraph.graph.composing.simplification import merge_junctions
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Element
from bondgraph.laws import (
    ContactLoss,
    Diode,
    FrictionAlongWay,
    FrictionUnderLoad,
    Law,
    LawSum,
    LettingGo,
    Polynomial,
    Radiation,
)
from bondgraph.support.errors import GraphError
from identification.diagnosis.screening.latent_input import probed_graph
from tests.settled import simulate

ALONG = FrictionAlongWay("q_k", 0.4, 0.02, 0.1)
RADIATES = Radiation(2.0, 0.05, coefficient="d")


def oscillator(law: Law) -> BondGraph:
    with BondGraph("oscillator") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("d", 2.0, law=law)
        body >> C("k", stiffness=100.0)
        body >> Df("v")
    return g


def component(law: Law) -> BondGraph:
    with BondGraph("component") as g:
        body = One("body")
        Port("end") >> body >> R("d", 2.0, law=law)
        body >> C("k", stiffness=100.0)
    return g


def used(law: Law, **bindings: Any) -> BondGraph:
    """The oscillator with its damper and spring in a component, beside a spring called so too."""
    with BondGraph("outer") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> use(component(law), "s", **bindings).end
        body >> Df("v")
        body >> One("other") >> C("k", 1e9)  # it is moved, and gives no force
    return g


def at(g: BondGraph, name: str) -> Any:
    return g[name]


def speed(g: BondGraph) -> Any:
    t = 0.01 * np.arange(60)
    rest = np.zeros(len(g.of_type(C, I)))
    return simulate(g, t, {"F": 3.0 * np.sin(20.0 * t)}, x0=rest)["v"]


def test_a_watched_signal_follows_into_another_graph() -> None:
    g = used(ALONG)
    assert at(g, "s_d").law.watched == "q_s_k"
    np.testing.assert_allclose(speed(g), speed(oscillator(ALONG)), atol=1e-6)


@pytest.mark.parametrize("law", [RADIATES, LettingGo("q_k", "d", width=0.01)])
def test_a_shared_coefficient_follows_into_another_graph(law: Law) -> None:
    g = used(law)
    assert at(g, "s_d").law.coefficient == "s_d"
    assert "d" not in g.parameters
    np.testing.assert_allclose(speed(g), speed(oscillator(law)), atol=1e-6)


@pytest.mark.parametrize(
    "element",
    [
        R("d", 2.0, law=Diode(coefficient="d")),
        C("d", stiffness=2.0, law=ContactLoss(coefficient="d")),
        C("d", 2.0, law=LawSum((Polynomial(), ContactLoss(coefficient="d", inverse=True)))),
    ],
)
def test_one_number_stays_one_number(element: Element) -> None:
    with BondGraph("part") as part:
        Port("end") >> One("body") >> element
    with BondGraph("outer") as g:
        Se("F") >> use(part, "s", d=5.0).end
    assert g.parameters["s_d"].value == 5.0
    assert "d" not in g.parameters


def test_a_coefficient_may_be_a_parameter_outside() -> None:
    with BondGraph("outer") as g:
        b = g.parameter("b", 3.0)
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> use(component(RADIATES), "s", d="b").end
        body >> Df("v")
    assert at(g, "s_d").law.coefficient == "b"
    np.testing.assert_allclose(
        speed(g), speed(oscillator(RADIATES).with_values({"d": 3.0})), atol=1e-6
    )
    with pytest.raises(GraphError, match="coefficient 'd' cannot be the expression"), g:
        use(component(RADIATES), "twice", d=2 * b)


def test_a_coefficient_may_be_a_declared_parameter() -> None:
    with BondGraph("part") as part:
        part.parameter("b", 3.0)
        Port("end") >> One("body") >> R("d", "b", law=Radiation(coefficient="b"))
    with BondGraph("outer") as g:
        Se("F") >> use(part, "s").end
    assert at(g, "s_d").value == at(g, "s_d").law.coefficient == "s_b"
    assert g.parameters["s_b"].value == 3.0
    assert at(rename(part, "b", "c"), "d").law.coefficient == "c"


def test_renamed_with_the_element() -> None:
    g = rename(oscillator(LettingGo("q_k", "d", width=0.01)), "k", "spring")
    g = rename(g, "d", "damper")
    assert (at(g, "damper").law.watched, at(g, "damper").law.coefficient) == ("q_spring", "damper")
    np.testing.assert_allclose(
        speed(g), speed(oscillator(LettingGo("q_k", "d", width=0.01))), atol=1e-9
    )


def test_what_a_law_reads_cannot_be_removed() -> None:
    with pytest.raises(GraphError, match="k is needed by the expression of d"):
        oscillator(ALONG).remove("k")
    g = oscillator(ALONG).with_element("d", law=None).with_element("F", drive=Drive(law=ALONG))
    with pytest.raises(GraphError, match="k is needed by the expression of F"):
        g.remove("k")
    assert at(rename(g, "k", "spring"), "F").drive.law.watched == "q_spring"


def test_the_signal_of_a_bond_stays_where_it_was() -> None:
    g = oscillator(FrictionUnderLoad("e_body>k", 0.1, 0.2))
    (bond,) = g.bonds_of("k")
    assert at(g.with_inserted(bond, Zero("node")), "d").law.watched == "e_body>node"
    probed = probed_graph(oscillator(FrictionUnderLoad("e_k", 0.1, 0.2)))
    assert "k" in probed.ports
    assert at(probed.graph, "d").law.watched == "e_body>probe_k_1"


def test_merged_junctions_keep_what_is_read() -> None:
    g = oscillator(FrictionUnderLoad("f_last", 0.1, 0.2))
    g = g.with_branch("body", (One("last"), R("r", 1.0)))
    assert at(merge_junctions(g), "d").law.watched == "f_body"
