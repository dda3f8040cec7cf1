"""A base that moves: its velocity, displacement or acceleration may be what is recorded."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from bondgraph import BondGraph, C, Da, Df, Dq, I, MSf, One, R, Se, Sf, Zero, derive, system
from bondgraph.analysis.linear import LAPLACE
from bondgraph.analysis.operator_equations import operator_equations
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph.elements import Sensor
from bondgraph.laws import Law, Polynomial
from bondgraph.simulation.simulate import simulate
from bondgraph.support.errors import GraphError

UNITS = {"value": "m/s", "rate": "m/s^2", "integral": "m"}
OMEGA = 9.0
CUBIC = Polynomial(orders=(3,), size=1.0)


def shaken(given: str, *sensors: Sensor, law: Law | None = None) -> BondGraph:
    with BondGraph("shaken") as g:
        base, s, gap, body = (
            Sf("b", unit=UNITS[given], given=given),
            Zero("s"),
            One("gap"),
            One("m_"),
        )
        base >> s >> body >> I("m", 0.3, unit="kg")
        s >> gap >> C("k", stiffness=200.0, unit="N/m", law=law)
        gap >> R("d", 0.8, unit="N*s/m")
        for sensor in sensors or (Dq("x", unit="m"), Df("v", unit="m/s")):
            if sensor.name not in g.elements:
                g.add(sensor)
            body >> sensor
    return g


def recorded(t: np.ndarray) -> dict[str, np.ndarray]:
    return {
        "value": np.sin(OMEGA * t),
        "rate": OMEGA * np.cos(OMEGA * t),
        "integral": (1 - np.cos(OMEGA * t)) / OMEGA,
    }


def error(n: int, given: str, law: Law | None = None) -> float:
    """Largest difference to the run by the velocity, over what moves."""
    t = np.linspace(0, 2, n)
    values = {"a_3_k": 5e4} if law else {}
    fine = np.linspace(0, 2, 32001)
    right = simulate(shaken("value", law=law), fine, {"b": recorded(fine)["value"]}, values)
    found = simulate(shaken(given, law=law), t, {"b": recorded(t)[given]}, values)
    every = 32000 // (n - 1)
    x = np.asarray(right["x"])[::every]
    return float(np.abs(np.asarray(found["x"]) - x).max() / np.ptp(x))


@pytest.mark.parametrize("law", [None, CUBIC])
@pytest.mark.parametrize("given", ["rate", "integral"])
def test_whatever_is_recorded_the_body_moves_alike(given: str, law: Law | None) -> None:
    coarse, fine = error(501, given, law), error(1001, given, law)
    assert coarse < 1e-3
    # the recording between its samples is the only error: of second order
    assert coarse / fine > 3.0


def test_a_recorded_displacement_needs_no_derivative() -> None:
    space = derive(shaken("integral"))
    d, m, k, xb = sp.symbols("d m k b", positive=True)
    z_p, z_q = sp.symbols("z_p_m z_q_k", positive=True)
    symbols = {s.name: s for s in (d, m, k, xb, z_p, z_q)}
    rates = [e.xreplace({s: symbols[s.name] for s in e.free_symbols}) for e in space.dxdt]
    momentum = z_p + d * xb
    wanted = {"z_p_m": -d * momentum / m + k * (z_q + xb), "z_q_k": -momentum / m}
    for state, rate in zip(space.x, rates, strict=True):
        if state.name in wanted:
            assert sp.simplify(rate - wanted[state.name]) == 0, state


def test_what_needs_the_rate_itself_takes_the_general_engine() -> None:
    graph = shaken("integral", Da("a", unit="m/s^2"))
    assert system(graph).input_rates == ("d_b",)
    t = np.linspace(0, 2, 8001)
    run = simulate(graph, t, {"b": recorded(t)["integral"]})
    right = simulate(shaken("rate", Da("a", unit="m/s^2")), t, {"b": recorded(t)["rate"]})
    a, wanted = np.asarray(run["a"]), np.asarray(right["a"])
    assert np.abs(a - wanted)[10:].max() < 5e-3 * np.ptp(wanted)


def test_a_sensor_that_only_reads_changes_no_motion() -> None:
    t = np.linspace(0, 1, 2001)
    moving = np.sin(OMEGA * t) / OMEGA
    plain = shaken("integral", Df("v", unit="m/s"))
    both = shaken("integral", Df("v", unit="m/s"), Da("a", unit="m/s^2"))
    v, again = (np.asarray(simulate(g, t, {"b": moving})["v"]) for g in (plain, both))
    assert v[0] == again[0] == 0.0
    assert np.abs(v - again).max() < 2e-2 * np.ptp(v)


def test_an_accelerometer_on_a_shaken_base_reads_exactly() -> None:
    t = np.linspace(0, 2, 4001)
    graph = shaken("rate", Da("a", unit="m/s^2"), Df("v", unit="m/s"))
    run = simulate(graph, t, {"b": recorded(t)["rate"]})
    v = np.asarray(run["v"])
    difference = (v[2:] - v[:-2]) / (2 * t[1])
    assert np.abs(difference - np.asarray(run["a"])[1:-1]).max() < 1e-4 * np.ptp(difference)


def test_operator_equations_integrate_and_differentiate() -> None:
    for given, times in (("value", 1), ("rate", 1 / LAPLACE), ("integral", LAPLACE)):
        found = operator_equations(shaken(given)).equations
        (row,) = (e for e in found if e.element == "b")
        assert sp.simplify(dict((n, c) for c, n in row.known)["b"] + times) == 0


def test_a_file_keeps_it() -> None:
    again = from_json(to_json(shaken("rate")))
    assert again["b"] == Sf("b", unit="m/s^2", given="rate")


def test_a_unit_of_something_else_and_a_wrong_word_are_told() -> None:
    graph = shaken("rate").with_element("b", unit="m/s")
    assert any("b (Sf" in line or "b:" in line for line in graph.check())
    graph = shaken("rate").with_element("b", given="speed")
    assert any("speed" in line and "rate" in line for line in graph.check())
    with pytest.raises(GraphError, match="leave out given"):
        shaken("value").replace("b", MSf("b", 2.0, unit="m/s", given="rate"))


def test_a_force_by_its_rate() -> None:
    with BondGraph("pushed") as g:
        v = One("v")
        Se("F", unit="N/s", given="rate") >> v >> I("m", 0.5, unit="kg")
        v >> R("d", 2.0, unit="N*s/m")
        v >> Df("speed", unit="m/s")
    assert g.check() == ()
    t = np.linspace(0, 1, 1001)
    run = simulate(g, t, {"F": np.full(t.size, 3.0)}, x0={"u_F": 0.0, "p_m": 0.0})
    # m v' + d v = 3 t
    expected = 1.5 * t - 0.375 * (1 - np.exp(-4 * t))
    assert np.asarray(run["speed"]) == pytest.approx(expected, abs=1e-6)
