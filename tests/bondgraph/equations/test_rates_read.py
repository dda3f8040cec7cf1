"""An accelerometer reads the rate of a flow, at a 0-junction that of an effort: exactly."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from bondgraph import BondGraph, C, Da, De, Dq, I, One, R, Se, Sf, Zero
from bondgraph.analysis.linear import LAPLACE
from bondgraph.analysis.operator_equations import operator_equations
from bondgraph.equations.derivation import equations
from bondgraph.equations.refusals import NotLinearUpToLaws
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.laws import Coulomb, Law, Polynomial
from bondgraph.simulation.lure import compile_model
from bondgraph.support.errors import BondsightError
from tests.settled import simulate

CUBIC = Polynomial(orders=(3,), size=1.0)


def spring(law: Law | None = None, friction: Law | None = None) -> BondGraph:
    with BondGraph("spring") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        v >> R("d", 2.0, unit="N*s/m", law=friction)
        v >> C("k", stiffness=200.0, unit="N/m", law=law)
        v >> Dq("x", unit="m")
        v >> Da("a", unit="m/s^2")
    return g


def circuit() -> BondGraph:
    """The current jumps with the voltage: its rate is partly that of the input."""
    with BondGraph("circuit") as g:
        i, z = One("i"), Zero("z")
        Se("u", unit="V") >> i >> R("r", 2.0, unit="ohm")
        i >> z >> C("c", 1e-3, unit="F")
        z >> Da("du", unit="V/s")
        i >> Da("di", unit="A/s")
    return g


def test_the_acceleration_is_the_balance_of_forces_symbol_by_symbol() -> None:
    m, d, k, p, q, force = sp.symbols("m d k p_m q_k F", positive=True)
    found = dict(zip(("x", "a"), equations(spring()).outputs, strict=True))["a"]
    named = {s.name: s for s in (m, d, k, p, q, force)}
    found = found.xreplace({s: named[s.name] for s in found.free_symbols})
    assert sp.simplify(found - (force - d * p / m - k * q) / m) == 0


def test_a_law_reaches_the_accelerometer_at_once() -> None:
    found = equations(spring(CUBIC)).shown("y_a")
    assert any(f.func.__name__ == "k" for f in found.atoms(sp.Function))


@pytest.mark.parametrize("law", [None, CUBIC])
def test_it_is_the_second_derivative_of_the_displacement(law: Law | None) -> None:
    t = np.linspace(0, 2, 8001)
    run = simulate(spring(law), t, {"F": np.sin(9 * t)}, {"a_3_k": 1e4} if law else {})
    x, a = np.asarray(run["x"]), np.asarray(run["a"])
    h = t[1]
    difference = (x[2:] - 2 * x[1:-1] + x[:-2]) / h**2
    assert np.abs(difference - a[1:-1]).max() < 1e-4 * np.abs(a).max()


def test_dry_friction_jumps_in_the_reading_and_not_in_the_flow() -> None:
    t = np.linspace(0, 4, 4001)
    graph = spring(friction=Coulomb())
    run = simulate(graph, t, {"F": 2 * np.sin(5 * t)}, {"F_c_d": 0.5, "d": 1.0})
    a = np.asarray(run["a"])
    assert np.abs(np.diff(a)).max() > 0.5  # F_c / m is 1, an amplitude of acceleration about 4


def test_what_an_input_moves_at_once_takes_the_rate_of_the_input() -> None:
    with pytest.raises(NotLinearUpToLaws, match="di reads the rate of a signal that u moves"):
        compile_model(circuit())
    assert equations(circuit()).lure is None
    assert equations(circuit()).input_rates == ("d_u",)
    t = np.linspace(0, 0.02, 4001)
    u = np.sin(300 * t)
    run = simulate(circuit(), t, {"u": u})
    # i' = (u' - i / c) / r with i = c du
    i = 1e-3 * np.asarray(run["du"])
    expected = (300 * np.cos(300 * t) - i / 1e-3) / 2.0
    assert np.abs(np.asarray(run["di"]) - expected)[2:].max() < 2e-3 * np.abs(expected).max()


@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.floats(10.0, 1e3))
def test_operator_equations_give_the_same_response(m: float, d: float, k: float) -> None:
    found = operator_equations(spring())
    at = 2j * np.pi
    numbers = {"m": m, "d": d, "k": k, str(LAPLACE): at}

    def value(c: sp.Expr) -> complex:
        c = sp.sympify(c)
        return complex(c.subs({v: numbers[v.name] for v in c.free_symbols}))

    columns = [*found.unknowns, *found.sensors]
    matrix = np.zeros((len(found.equations), len(columns)), complex)
    right = np.zeros(len(found.equations), complex)
    for row, equation in enumerate(found.equations):
        for c, n in (*equation.unknown, *equation.known):
            if n in columns:
                matrix[row, columns.index(n)] += value(c)
            else:
                right[row] -= value(c)  # the force is one
    solved = dict(zip(columns, np.linalg.lstsq(matrix, right, rcond=None)[0], strict=True))
    assert solved["x"] == pytest.approx(1.0 / (m * at**2 + d * at + k))
    assert solved["a"] == pytest.approx(at**2 * solved["x"])


def test_a_file_keeps_it() -> None:
    again = from_json(to_json(spring()))
    assert equations(again).outputs == equations(spring()).outputs
    assert again["a"] == Da("a", unit="m/s^2")


@pytest.mark.parametrize(
    ("at", "unit", "says"),
    [("v", "m/s", "a"), ("v", "m", "a"), ("z", "N", "a")],
)
def test_a_unit_of_something_else_is_told(at: str, unit: str, says: str) -> None:
    with BondGraph("b") as g:
        v, z = One("v"), Zero("z")
        Sf("s", unit="m/s") >> z >> C("k", stiffness=10.0, unit="N/m")
        z >> v >> I("m", 1.0, unit="kg")
        {"v": v, "z": z}[at] >> Da(says, unit=unit)
    assert any(says in line and unit in line for line in g.check())


def test_it_sits_at_a_junction() -> None:
    with BondGraph("b") as g:
        Se("F", unit="N") >> I("m", 1.0, unit="kg") >> Da("a")
    with pytest.raises(BondsightError):
        equations(g)


def test_an_effort_reads_beside_its_rate() -> None:
    with BondGraph("tank") as g:
        z = Zero("z")
        Sf("q", unit="m^3/s") >> z >> C("c", 2.0, unit="m^3/Pa")
        z >> R("r", 3.0, unit="Pa*s/m^3")
        z >> De("p", unit="Pa")
        z >> Da("dp", unit="Pa/s")
    p, dp = equations(g).outputs
    flow = sp.Symbol("q")
    numbers = {s: {"c": 2.0, "r": 3.0, "q": 5.0, "q_c": 7.0}[s.name] for s in dp.free_symbols}
    assert flow.name in {s.name for s in dp.free_symbols}
    assert float(dp.subs(numbers)) == pytest.approx((5.0 - 3.5 / 3.0) / 2.0)
    assert float(p.subs(numbers)) == pytest.approx(3.5)
