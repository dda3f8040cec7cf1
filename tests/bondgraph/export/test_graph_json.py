"""Graphs to JSON and back: nothing lost."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import bondgraph.laws as all_laws
from actuators.models.catalogue import MODELS
from bondgraph import BondGraph
from bondgraph.export.graph_json.element_forms import ELEMENTS, LAWS, NAMED
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.schema import graph_schema
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph import elements as el
from bondgraph.graph import sensors
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Element
from bondgraph.graph.sensors import De
from bondgraph.hysteresis import Operator
from bondgraph.laws import (
    Backlash,
    Hysteretic,
    Law,
    Parametrised,
    PiecewiseLinear,
)
from bondgraph.support.errors import UnusableInput
from bondgraph.support.typed_reader import Rules, hints_of
from tests.bondgraph.export.json_examples import LAW_EXAMPLES, VALIDATOR, assert_same, every_element
from tests.bondgraph.hysteresis.examples import EXAMPLES
from tests.settled import simulate


def assert_round_trip(graph: BondGraph) -> None:
    text = to_json(graph)
    VALIDATOR.validate(json.loads(text))
    back = from_json(text)
    assert_same(graph, back)
    assert to_json(back) == text


@pytest.mark.parametrize("name", MODELS)
def test_models_of_the_catalogue(name: str) -> None:
    assert_round_trip(MODELS[name]())


def test_every_element_and_field() -> None:
    g = every_element()
    assert {e.kind for e in g.elements.values()} == set(ELEMENTS)
    assert_round_trip(g)
    touched = set()
    for e in g.elements.values():
        touched |= {(f.name) for f in fields(e) if getattr(e, f.name) != f.default}
        assert {f.name for f in fields(e)} == set(hints_of(type(e), Rules(names=NAMED)))
    assert touched == {f.name for cls in ELEMENTS.values() for f in fields(cls)}


def test_tables_hold_every_element_and_law() -> None:
    def leaves(cls: type[Any]) -> set[type[Any]]:
        below = {c for s in cls.__subclasses__() for c in leaves(s)}
        return (below | {cls}) if getattr(cls, "kind", "") else below

    own = (el.__name__, sensors.__name__)
    assert {c for c in leaves(Element) if c.__module__ in own} == set(ELEMENTS.values())
    every = [getattr(all_laws, n) for n in dir(all_laws)]
    laws = {v for v in every if isinstance(v, type) and issubclass(v, Law)}
    assert set(LAWS) == laws - {Law}
    defs = graph_schema()["$defs"]
    for entry in defs["element"]["oneOf"]:
        p = entry["properties"]
        assert set(p) == {"kind"} | {f.name for f in fields(ELEMENTS[p["kind"]["const"]])}
    named = [e["properties"] for e in defs["law"]["oneOf"][:-1]]
    assert [set(p) for p in named] == [{"law"} | {f.name for f in fields(law)} for law in LAWS]
    assert set(LAW_EXAMPLES) == {law.name for law in LAWS}


@pytest.mark.parametrize("name", LAW_EXAMPLES)
def test_laws(name: str) -> None:
    law = LAW_EXAMPLES[name]
    assert law.name == name
    with BondGraph("laws") as g:
        el.R("R_1", 1.0, law=law)
        el.Se("V", drive=Drive(law=law))
        De("y", law=law)
    assert_round_trip(g)


def test_a_shared_coefficient_stays_one_parameter() -> None:
    with BondGraph("shared") as g:
        el.C("k", stiffness=3.0, unit="N/m", law=Backlash(coefficient="k", stiffness=3.0))
    assert_round_trip(g)
    assert list(g.parameters) == ["k", "gap_k", "centre_k"]


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ({"law": "coulomb"}, "closed form"),
        ({"law": "polynomial", "orders": [3]}, "no field 'knots'"),
        (
            {"law": "lifted", "inner": {"law": "polynomial"}, "lifted": ["half"]},
            "not a law that is not lifted",
        ),
        ({"law": "unnamed_curve"}, None),
    ],
)
def test_lifted_laws_are_checked(law: dict[str, Any], message: str | None) -> None:
    with BondGraph("lifted") as g:
        el.C("C_1", 1.0, law=Parametrised(PiecewiseLinear((-1.0, 0.5, 1.0)), ("knots",)))
    data = json.loads(to_json(g))
    (element,) = data["elements"]
    element["law"]["inner"] = law
    if message is None:
        assert isinstance(from_json(json.dumps(data)).elements["C_1"], el.C)
        return
    with pytest.raises(UnusableInput, match=message) as caught:
        from_json(json.dumps(data))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", EXAMPLES)
def test_operators(name: str) -> None:
    with BondGraph("operators") as g:
        el.C("C_1", 1.0, law=Hysteretic(EXAMPLES[name]))
    assert_round_trip(g)


def test_simulates_to_the_same_bits(tmp_path: Path) -> None:
    from actuators.stack.bond_graph import stack_bond_graph

    graph = stack_bond_graph(law=Hysteretic(EXAMPLES["maxwell_resistive_capacitor"]))
    file = tmp_path / "stack.json"
    file.write_text(to_json(graph), encoding="utf-8")
    t = np.linspace(0.0, 1e-3, 50)
    drive = {"V_in": 10.0 * np.sin(2 * np.pi * 2e3 * t)}
    one, two = (simulate(g, t, drive)["x"] for g in (graph, from_json(file)))
    assert np.ptp(one) > 0.0
    assert np.array_equal(one, two)


@settings(max_examples=100, deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(-(2**53), 2**53))
def test_numbers_keep_their_bits(x: float, n: int) -> None:
    with BondGraph("numbers") as g:
        g.parameter("p", x, positive=False)
        el.R("R_1", x)
        el.R("R_2", n)
        el.R("R_3", 1.0)
        el.TF("T_1", sp.Float(x) * sp.Symbol("R_3", positive=True) + n)
    back = from_json(to_json(g))
    assert repr(back.elements) == repr(g.elements)
    assert str(back.parameters) == str(g.parameters)


def test_reads_inside_of_a_block_without_joining_it() -> None:
    text = to_json(MODELS["stack_lumped"]())
    with BondGraph("outer") as outer:
        inner = from_json(text)
    assert not outer.elements
    assert inner.elements


@dataclass(frozen=True)
class OwnLaw(Law):
    """A law that only a program knows."""

    operator: Operator
    linear: float
    name: ClassVar[str] = "own"

    def deviation(self, ops: Any, s: Any, memory: Any, p: Any) -> Any:
        return self.linear * s


def test_laws_of_a_program() -> None:
    with BondGraph("own law") as g:
        el.C("C_1", law=OwnLaw(EXAMPLES["prandtl_ishlinskii"], -0.3))
    with pytest.raises(UnusableInput, match="OwnLaw has no place in a file"):
        to_json(g)
    text = to_json(g, laws=[OwnLaw])
    VALIDATOR.validate(json.loads(text))
    assert_same(from_json(text, laws=[OwnLaw]), g)
    with pytest.raises(UnusableInput, match="no law 'own'"):
        from_json(text)


class NotOfTheLanguage(el.R):
    pass


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (float("nan"), "not a finite number"),
        (2**60, r"within 2\*\*53"),
        (sp.Symbol("foreign"), "not made by Bondsight"),
        (sp.gamma(sp.Symbol("a", positive=True)), "gamma has no place"),
        (sp.Float("0.1", 30), "precision of a double"),
    ],
)
def test_what_cannot_be_written(value: Any, message: str) -> None:
    with BondGraph("g") as g:
        g.parameter("a", 1.0)
        el.R("R_1", value)
    with pytest.raises(UnusableInput, match=message) as caught:
        to_json(g)
    assert "g: R_1.value" in str(caught.value)


def test_a_class_of_ones_own_cannot_be_written() -> None:
    with BondGraph("g") as g:
        NotOfTheLanguage("R_1", 1.0)
    with pytest.raises(UnusableInput, match="NotOfTheLanguage has no place"):
        to_json(g)
