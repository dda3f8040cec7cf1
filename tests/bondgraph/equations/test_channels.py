"""What every sensor has: gain, offset, resolution and dynamics of first and second order."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from scipy import signal

from bondgraph import BondGraph, R, Reading
from bondgraph.analysis.linear import LAPLACE
from bondgraph.analysis.operator_equations import operator_equations
from bondgraph.equations.derivation import equations
from bondgraph.graph.composing.hierarchy import use
from bondgraph.graph.modulation import effort, flow
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Coulomb, FrictionAlongWay, Polynomial, Rectifier
from bondgraph.laws.rounding import Resolution
from bondgraph.support.errors import BondsightError
from bondgraph.support.ops import CASADI, NUMPY
from tests.bondgraph.readings_bench import FORCE, TIME, spring
from tests.settled import simulate
from tests.symbols import closed


def read(values: dict[str, float] | None = None, **channel: Any) -> np.ndarray:
    return np.asarray(simulate(spring(**channel), TIME, {"F": FORCE}, values)["x"])


PLAIN = read()


def test_gain_then_offset_then_rounding() -> None:
    wanted = 2.0 * PLAIN + 0.013
    assert read(gain=2.0, offset=0.013) == pytest.approx(wanted, abs=1e-12)
    grid = np.round(read(gain=2.0, offset=0.013, resolution=4e-3) / 4e-3, 6)
    assert (grid == np.round(grid)).all()
    assert np.abs(4e-3 * grid - wanted).max() <= 2e-3 + 1e-12
    assert len(set(grid)) > 5


def test_a_law_comes_before_the_gain() -> None:
    found = read(law=Rectifier(1.0), gain=-3.0, offset=0.5, resolution=1e-3)
    assert np.abs(found - (0.5 - 3.0 * np.abs(PLAIN))).max() <= 0.5e-3 + 1e-9


def test_first_and_second_order_dynamics_are_those_of_scipy() -> None:
    omega, zeta, tau = 80.0, 0.3, 0.02
    system_ = signal.TransferFunction([omega**2], [1.0, 2 * zeta * omega, omega**2])
    _, expected, _ = signal.lsim(system_, PLAIN, TIME)
    found = read(natural_frequency=omega, damping_ratio=zeta)
    assert np.abs(found - expected).max() < 1e-4 * np.ptp(expected)
    _, expected, _ = signal.lsim(signal.TransferFunction([1.0], [tau, 1.0]), expected, TIME)
    found = read(natural_frequency=omega, damping_ratio=zeta, lag=tau)
    assert np.abs(found - expected).max() < 1e-4 * np.ptp(expected)


def test_the_equations_symbol_by_symbol() -> None:
    graph = spring(natural_frequency=80.0, damping_ratio=0.3, gain=2.0, offset=0.1, lag=0.02)
    space = closed(equations(graph))
    symbols = {str(s): s for e in (*space.dxdt, *space.y) for s in e.free_symbols}
    names = "natural_frequency_x damping_ratio_x gain_x offset_x lag_x z_x shown_x rate_shown_x q_k"
    w, zeta, gain, offset, tau, z, y, v, q = (symbols[n] for n in names.split())
    rates = space.rates
    assert sp.simplify(rates["z_x"] - (q - z) / tau) == 0
    assert rates["shown_x"] == v
    assert sp.simplify(rates["rate_shown_x"] - (w**2 * (z - y) - 2 * zeta * w * v)) == 0
    assert sp.simplify(space.y[0] - (gain * y + offset)) == 0
    assert equations(graph).inputs == ("F",)  # an offset is no input that somebody has to give


def test_operator_equations_have_the_same_response() -> None:
    graph = spring(natural_frequency=80.0, damping_ratio=0.3, gain=2.0, offset=0.1, lag=0.02)
    (row,) = (e for e in operator_equations(graph).equations if e.role == "reading")
    values = {n: p.value for n, p in graph.parameters.items()} | {str(LAPLACE): 1j * 50.0}

    def at(c: sp.Expr) -> complex:
        return complex(sp.sympify(c).subs({s: values[str(s)] for s in c.free_symbols}))

    known = {n: at(c) for c, n in row.known}
    ((c, _),) = row.unknown
    z = 50j / 80
    assert -at(c) / known["x"] == pytest.approx(2.0 / ((1 + 1j) * (z**2 + 0.6 * z + 1)))
    assert known["one"] == pytest.approx(-0.1 * known["x"])


def test_names_symbols_and_expressions_are_parameters() -> None:
    g = spring()
    turn = g.parameter("turn", 4.0, positive=True)
    g.parameter("zero", 0.5, "m", positive=False)
    g = g.with_element("x", gain=2 / turn, offset="zero")
    found = np.asarray(simulate(g, TIME, {"F": FORCE}, {"turn": 8.0, "zero": 0.25})["x"])
    assert found == pytest.approx(PLAIN / 4 + 0.25, abs=1e-12)


def test_a_number_is_a_known_parameter_with_the_name_of_its_sensor() -> None:
    graph = spring(gain=2.0, resolution=1e-3, natural_frequency=80.0, damping_ratio=0.3)
    own = {n: p for n, p in graph.parameters.items() if n.endswith("_x")}
    assert {n: p.value for n, p in own.items()} == {
        "gain_x": 2.0, "resolution_x": 1e-3, "natural_frequency_x": 80.0, "damping_ratio_x": 0.3,
    }  # fmt: skip
    assert all(p.fixed for p in own.values())
    assert own["natural_frequency_x"].unit == "rad/s"
    changed = graph.with_values({"gain_x": -1.0})
    assert np.asarray(simulate(changed, TIME, {"F": FORCE})["x"]).min() == pytest.approx(
        -np.asarray(simulate(graph, TIME, {"F": FORCE})["x"]).max() / 2, abs=1.1e-3
    )


def test_the_reading_follows_through_the_rounding() -> None:
    law, s = Resolution(), 2.3456
    for step in (0.01, 0.07, 0.5):
        value = s + law.deviation(NUMPY, s, (), (step,))
        assert value == pytest.approx(step * np.floor(s / step + 0.5), abs=1e-9 * step)
    x = ca.SX.sym("x")
    slope = ca.jacobian(x + law.deviation(CASADI, x, (), (0.07,)), x)
    assert float(ca.Function("slope", [x], [slope])(s)) == 1.0


@pytest.mark.parametrize("powered", [False, True])
def test_rounding_does_not_hinder_the_choice_of_sub_steps(powered: bool) -> None:
    """Both engines settle on what is read, not on its jumps."""

    def made(resolution: float | None) -> BondGraph:
        g = spring(resolution=resolution).with_element("k", law=Polynomial(orders=(3,), size=1.0))
        if powered:
            with g:
                Reading("P", effort("F") * flow("v"), unit="W", resolution=resolution)
        else:
            g = g.with_element("d", law=Coulomb())
        return g

    values = {"a_3_k": 5e4} | ({} if powered else {"F_c_d": 0.2})
    fine, coarse = (simulate(made(r), TIME, {"F": FORCE}, values) for r in (None, 5e-3))
    assert coarse.steps_per_sample == fine.steps_per_sample
    for n in fine.outputs:
        assert np.abs(np.asarray(fine[n]) - np.asarray(coarse[n])).max() <= 2.5e-3 + 1e-9


def test_a_late_reading_is_rounded_when_it_is_taken() -> None:
    graph = spring(delay="late", resolution=1e-3)
    with graph:
        graph.parameter("late", 0.37e-3, "s")
    found = np.asarray(simulate(graph, TIME, {"F": FORCE})["x"]) / 1e-3
    assert np.abs(found - np.round(found)).max() < 1e-6


def test_a_part_used_twice_has_its_own_channel() -> None:
    with BondGraph("two") as g:
        use(spring(gain=2.0), "one")
        use(spring(gain=3.0), "other")
    assert {g.parameters[n].value for n in ("gain_one_x", "gain_other_x")} == {2.0, 3.0}


def test_a_part_is_given_its_channel_from_outside() -> None:
    part = spring()
    part.parameter("late", 0.02, "s")
    part = part.with_element("x", lag="late", gain="late")
    with BondGraph("outer") as g:
        slow = g.parameter("slow", 0.01, "s")
        use(part, "part", late=2 * slow)
    found = np.asarray(simulate(g, TIME, {"part_F": FORCE})["part_x"])
    assert found == pytest.approx(0.02 * read(lag=0.02), abs=1e-12)


@pytest.mark.parametrize(
    ("channel", "says"),
    [
        ({"natural_frequency": 80.0}, "natural_frequency .* and a damping_ratio.* give both"),
        ({"gain": 0.0}, "gain 0.0 must not be 0"),
        ({"lag": 0.0}, "lag 0.0 must be positive"),
        ({"resolution": -1.0}, "resolution -1.0 must be positive"),
        ({"offset": float("nan")}, "offset nan is not a finite number"),
        ({"gain": "factor"}, "gain: no parameter 'factor'"),
        ({"resolution": "m"}, "no fit finds it; declare it fixed=True"),
        ({"resolution": 2 * sp.Symbol("m", positive=True)}, "give a number, or declare"),
    ],
)
def test_what_makes_no_sense_is_one_line(channel: dict[str, Any], says: str) -> None:
    with pytest.raises(BondsightError, match=says):
        spring(**channel).require_sound()


def test_a_word_that_is_no_value_is_refused_at_once() -> None:
    with pytest.raises(BondsightError, match="x: gain = True is no number"):
        spring(gain=True)


def test_a_gain_may_change_the_unit() -> None:
    assert spring().with_element("x", unit="V").check() != ()
    assert spring(gain=20.0).with_element("x", unit="V").check() == ()


def test_an_element_called_like_a_port_of_a_law_is_refused() -> None:
    graph = spring(resolution=1e-3).with_branch("v", [R("x_resolution", 0.1, law=Rectifier(1.0))])
    with pytest.raises(BondsightError, match="'x_resolution' is an element with a law"):
        equations(graph)
    watching = R("d2", 0.1, law=FrictionAlongWay("q_k"))
    graph = spring().with_branch("v", [watching])
    graph = graph.with_branch("v", [R("beside_d2", 0.1, law=Rectifier(1.0))])
    with pytest.raises(BondsightError, match="'beside_d2' is an element with a law"):
        equations(graph)


def test_a_new_value_of_a_channel_stands_in_its_field() -> None:
    graph = spring(lag=0.01).with_values({"lag_x": 0.5})
    assert graph["x"] == spring(lag=0.5)["x"]
    assert graph.with_element("x", lag=0.02).parameters["lag_x"].value == 0.02
    assert graph.declared_parameters == {}
    assert "its lag -0.5 must be positive" in " ".join(graph.with_values({"lag_x": -0.5}).check())


@pytest.mark.parametrize(("field", "value"), [("lag", 0.01), ("gain", 2.0)])
def test_a_number_of_a_channel_that_is_declared_as_well_is_refused(
    field: str, value: float
) -> None:
    channel: dict[str, Any] = {field: value}
    graph = spring(**channel).with_parameters([Parameter(f"{field}_x", 3.0)])
    with pytest.raises(BondsightError, match=f"is the parameter {field}_x, which is declared"):
        simulate(graph, TIME, {"F": FORCE})
    channel = {field: f"{field}_x"}
    assert spring(**channel).with_parameters(graph.declared_parameters.values()).check() == ()


@pytest.mark.parametrize("value", [0.0, -0.1])
def test_a_lag_that_is_tried_must_be_positive(value: float) -> None:
    with pytest.raises(BondsightError, match=rf"its lag {value} must be positive"):
        read({"lag_x": value}, lag=0.02)


def test_a_mass_of_zero_is_one_line() -> None:
    with pytest.raises(BondsightError, match=r"divide by a parameter that is 0.*\(m\)"):
        read({"m": 0.0})


def test_the_unit_of_a_gain_is_not_claimed() -> None:
    assert spring(gain=20.0).with_element("x", unit="V").parameters["gain_x"].unit == ""
