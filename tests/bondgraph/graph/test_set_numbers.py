"""What `with_values` set stays where a graph is made from another one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from actuators.stack.charge_drive import current_driven
from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se
from bondgraph.graph.composing.hierarchy import embedded
from bondgraph.graph.composing.rewriting import rename
from bondgraph.graph.composing.simplification import (
    collapse_junctions,
    merge_junctions,
)
from bondgraph.graph.drives import Drive
from bondgraph.laws import Polynomial
from tests.settled import simulate

HARD = Polynomial(half=0.02, orders=(3,), unit="N")
BENT = Polynomial(half=5.0, orders=(2,), unit="N")
SET = {"a_3_k": 3.0, "a_2_F": 0.4, "d": 2.0, "push": 1.5}


def spring() -> BondGraph:
    with BondGraph("spring") as g:
        g.parameter("push", 1.0)
        body = One("body")
        Se("F", drive=Drive(law=BENT), gain="push") >> body >> I("m", 1.0)
        body >> R("d", 1.0)
        body >> C("k", stiffness=400.0, law=HARD)
        body >> Dq("x")
        body >> Df("v")
    return g.with_values(SET)


def values(graph: BondGraph) -> dict[str, float]:
    return {n: p.value for n, p in graph.parameters.items()}


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (lambda g: g.remove("v"), {}),
        (lambda g: g.remove("v", collapse=True, drop_parameters=True), {}),
        (lambda g: g.replace("d", R("rub", 2.0)), {"d": "rub"}),
        (lambda g: g.insert("body", R("more", 0.1)), {}),
        (lambda g: g.insert("body>k", One("end")), {}),
        (lambda g: rename(g, "k", "leaf"), {"a_3_k": "a_3_leaf"}),
        (lambda g: rename(g, "push", "pull"), {"push": "pull"}),
        (merge_junctions, {}),
        (collapse_junctions, {}),
        (lambda g: embedded(BondGraph("outer"), g, "one"), {n: f"one_{n}" for n in ("d", "push")}
         | {"a_3_k": "a_3_one_k", "a_2_F": "a_2_one_F"}),
    ],
)  # fmt: skip
def test_numbers_that_were_set_stay(
    make: Callable[[BondGraph], BondGraph], names: dict[str, str]
) -> None:
    made = values(make(spring()))
    assert {n: made[names.get(n, n)] for n in SET} == SET


def test_an_element_that_replaces_another_brings_its_own_numbers() -> None:
    made = spring().replace("k", C("k", stiffness=300.0, law=HARD))
    assert values(made) == {**values(spring()), "k": 300.0, "a_3_k": 0.0}
    without = spring().remove("k")
    assert "a_3_k" not in without.parameters


def test_a_sensor_less_moves_nothing() -> None:
    t = 0.01 * np.arange(200)
    force = {"F": 30.0 * np.sin(7.0 * t)}
    whole = simulate(spring(), t, force)
    np.testing.assert_array_equal(simulate(spring().remove("v"), t, force)["x"], whole["x"])


def test_a_current_driven_stack_keeps_its_laws() -> None:
    with BondGraph("stack") as g:
        loop = One("loop")
        Se("V_in", unit="V") >> loop >> R("R_e", 10.0)
        loop >> C("C_nl", stiffness=1e6, law=HARD)
        loop >> Df("i")
    made = current_driven(g.with_values({"a_3_C_nl": 4.0}))
    assert made.parameters["a_3_C_nl"].value == 4.0
