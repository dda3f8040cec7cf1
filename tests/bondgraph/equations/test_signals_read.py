"""A reading of any signal: forces inside a chain, differences, stored quantities, powers."""

from __future__ import annotations

import re

import numpy as np
import pytest
import sympy as sp

from bondgraph import TF, BondGraph, C, I, MSe, MSf, One, R, Reading, Se, Sf, Zero
from bondgraph.analysis.linear import LAPLACE
from bondgraph.analysis.operator_equations import operator_equations
from bondgraph.drawing.readings import readings
from bondgraph.equations.derivation import equations
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph.composing.hierarchy import use
from bondgraph.graph.modulation import TIME, displacement, effort, external, flow, momentum
from bondgraph.graph.parameter import symbol
from bondgraph.laws import Polynomial
from bondgraph.simulation.lure import compile_model
from bondgraph.support.errors import BondsightError
from tests.settled import simulate

CUBIC = Polynomial(orders=(3,), size=1.0)


def chain(*read: tuple[str, sp.Expr, str], cubic: bool = False) -> BondGraph:
    """Two masses with a spring and a damper between them."""
    with BondGraph("chain") as g:
        a, s, b, gap = One("a"), Zero("s"), One("b"), One("gap")
        Se("F", unit="N") >> a >> I("m1", 0.5, unit="kg")
        a >> s >> b >> I("m2", 0.3, unit="kg")
        b >> R("d2", 1.0, unit="N*s/m")
        s >> gap >> C("k", stiffness=200.0, unit="N/m", law=CUBIC if cubic else None)
        gap >> R("dk", 0.4, unit="N*s/m")
        for name, value, unit in read:
            Reading(name, value, unit=unit)
    return g


ALL = (
    ("force", effort("k"), "N"),
    ("dv", flow("a") - flow("b"), "m/s"),
    ("q", displacement("k"), "m"),
    ("p", momentum("m2"), "kg*m/s"),
    ("through", effort("a>s"), "N"),
)


def test_each_signal_symbol_by_symbol() -> None:
    found = dict(zip((n for n, *_ in ALL), equations(chain(*ALL)).outputs, strict=True))
    symbols = {s.name: s for e in found.values() for s in e.free_symbols}
    k, dk, m1, m2, q, p1, p2 = (symbols[n] for n in ("k", "dk", "m1", "m2", "q_k", "p_m1", "p_m2"))
    gap = p1 / m1 - p2 / m2
    wanted = {"force": k * q, "dv": gap, "q": q, "p": p2, "through": k * q + dk * gap}
    for name, value in wanted.items():
        assert sp.simplify(found[name] - value) == 0, name


def test_a_force_cell_reads_the_law_too() -> None:
    graph = chain(("force", effort("k"), "N"), ("q", displacement("k"), "m"), cubic=True)
    t = np.linspace(0, 2, 2001)
    run = simulate(graph, t, {"F": 20 * np.sin(9 * t)}, {"a_3_k": 5e4})
    q = np.asarray(run["q"])
    assert np.asarray(run["force"]) == pytest.approx(200.0 * q + 5e4 * q**3, rel=1e-9, abs=1e-9)
    assert np.abs(5e4 * q**3).max() > 1.0


def test_a_power_takes_the_general_engine() -> None:
    graph = chain(("P", effort("F") * flow("a"), "W"), ("v", flow("a"), "m/s"))
    with pytest.raises(BondsightError, match="not linear up to scalar laws"):
        compile_model(graph)
    t = np.linspace(0, 1, 1001)
    force = np.sin(9 * t)
    run = simulate(graph, t, {"F": force})
    assert np.asarray(run["P"]) == pytest.approx(force * np.asarray(run["v"]), abs=1e-12)
    assert equations(graph).outputs[0] is not None


def test_a_parameter_may_scale_what_is_read() -> None:
    with BondGraph("strain") as g:
        length = g.parameter("length", 0.25, "m")
        v = One("v")
        Se("F", unit="N") >> v >> C("k", stiffness=200.0, unit="N/m")
        v >> R("d", 3.0, unit="N*s/m")
        Reading("strain", displacement("k") / length, unit="1")
    (y,) = equations(g).outputs
    values = {"q_k": 0.5, "length": 0.25}
    assert float(y.subs({s: values[s.name] for s in y.free_symbols})) == pytest.approx(2.0)


def test_operator_equations_know_it() -> None:
    found = operator_equations(chain(*ALL))
    (row,) = (e for e in found.equations if e.element == "dv" and e.role == "signal")
    assert {n: int(c) for c, n in row.unknown} == {"r_dv": 1, "f_a": -1, "f_b": 1}
    assert LAPLACE not in {c for e in found.equations if e.element == "dv" for c, _ in e.unknown}


def test_a_file_and_a_drawing_keep_it() -> None:
    graph = chain(*ALL)
    again = from_json(to_json(graph))
    assert equations(again).outputs == equations(graph).outputs
    arrows = {(r.source, r.target) for r in readings(graph)}
    assert {("k", "force"), ("a", "dv"), ("b", "dv"), ("m2", "p")} <= arrows


@pytest.mark.parametrize("way", ["insert", "with_inserted"])
def test_what_is_put_into_a_bond_leaves_its_signal(way: str) -> None:
    graph = chain(("through", effort("a>s"), "N"), ("v", flow("a>s"), "m/s"))
    if way == "insert":
        after = graph.insert(("a", "s"), TF("lever", ratio=2.0))
        found = "e_a>lever"
    else:
        (bond,) = (b for b in graph.bonds if b.name == "a>s")
        after = graph.with_inserted(bond, One("between"))
        found = "e_a>between"
    assert str(after["through"].value) == found  # type: ignore[attr-defined]
    t = np.linspace(0, 1, 501)
    force = np.sin(9 * t)
    run = simulate(after, t, {"F": force})
    # what the first mass is left with: F - e = m v'
    v, e = np.asarray(run["v"]), np.asarray(run["through"])
    rest = force[1:-1] - e[1:-1] - 0.5 * (v[2:] - v[:-2]) / (2 * t[1])
    assert np.abs(rest).max() < 1e-3 * np.ptp(e)


def test_a_part_used_twice_reads_its_own_signals() -> None:
    with BondGraph("machine") as g:
        one, two = use(chain(("force", effort("k"), "N")), "one"), use(chain(ALL[2]), "two")
    assert one is not None
    assert two is not None
    reads = {e.name: str(e.value) for e in g.of_type(Reading)}
    assert sorted(reads.values()) == ["e_one_k", "q_two_k"]


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (None, "reads nothing"),
        (2.0, "reads nothing"),
        (effort("spring"), "no effort at 'spring'.*Known: "),
        (displacement("m1"), "no storage 'm1'.*Known: k"),
        (symbol("force"), "no signal 'force'"),
        (symbol("k"), r"a parameter.*graph.parameters\['k'\].symbol"),
    ],
)
def test_what_it_cannot_read_is_one_line(value: object, says: str) -> None:
    graph = chain(("r", value, "N"))
    (line,) = graph.check()
    assert re.search(says, line)
    with pytest.raises(BondsightError, match=says):
        equations(graph)


@pytest.mark.parametrize("value", [TIME, 2 * external("wind") + TIME])
def test_what_is_nothing_of_the_model_is_no_reading(value: sp.Expr) -> None:
    (line,) = chain(("r", value, "N")).check()
    assert "r (Reading) reads nothing of the model" in line


def test_a_modulated_source_reads_signals_that_there_are() -> None:
    with pytest.raises(BondsightError, match="no effort at 'nothing'"):
        chain().replace("F", MSe("F", effort("nothing")))


def test_a_sensor_has_no_signal_to_read() -> None:
    graph = chain(("force", effort("k"), "N"), ("again", effort("force"), "N"))
    assert any("reads the sensor force" in line for line in graph.check())


def test_it_has_no_bond() -> None:
    with BondGraph("b") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 1.0, unit="kg")
        v >> Reading("r", effort("m"))
    assert any("take its bond out" in line for line in g.check())


def test_a_modulated_source_takes_its_value_in_second_place() -> None:
    assert MSe("a", effort("b"), unit="V") == MSe("a", value=effort("b"), unit="V")


def test_the_flow_of_a_store_that_a_constant_holds_can_be_read() -> None:
    """A current that stands still has no voltage across its coil."""
    with BondGraph("held") as g:
        node, coil = Zero("node"), One("coil")
        Sf("F") >> node >> C("c", 2.0)
        node >> coil >> I("L", 2.0)
        coil >> R("r", 4.0)
        MSf("feed", 0.5) >> coil
        Reading("u", effort("feed"))
        Reading("u_L", effort("L"))
    t = np.linspace(0.0, 1.0, 11)
    run = simulate(compile_model(g), t, {"F": np.ones(11)})
    assert run["u_L"] == pytest.approx(np.zeros(11), abs=1e-12)
    assert run["u"] == pytest.approx(0.5 * 4.0 - 0.5 * t / 2.0, abs=1e-9)
