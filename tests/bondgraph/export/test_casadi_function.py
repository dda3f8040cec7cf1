"""CasADi functions of a model, run by CasADi's integrators against the simulation."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.hysteresis import stack_ang
from bondgraph import BondGraph, C, De, Df, I, One, R, Se, UnknownName, UnusableInput, Zero
from bondgraph.equations.codegen import program
from bondgraph.export.casadi_function import CasadiModel, casadi_functions, load
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic, Polynomial
from bondgraph.support.ops import FloatArray
from tests.bondgraph.export.loop_program import cubic_loop
from tests.settled import simulate

TIGHT = {"abstol": 1e-16, "reltol": 1e-10}
CARRIED = (["x", "m", "z_guess"], ["x_next", "m_next", "z"])


def rlc() -> BondGraph:
    with BondGraph("rlc") as g:
        loop = One("loop")
        _ = Se("V", unit="V") >> loop >> R("R_1", 20.0, unit="ohm")
        _ = loop >> I("L_1", 1e-2, unit="H")
        _ = loop >> C("C_1", 1e-6, unit="F")
        _ = loop >> Df("i", unit="A")
    return g


def slipping_stack() -> BondGraph:
    """The stack with springs that slip in its polarisation: closed minor loops."""
    size, field = 3e-6, 5e3
    capacitor = MaxwellResistiveCapacitor(
        tuple(field / size * k for k in (0.6, 0.4, 1.0)),
        tuple(field * v for v in (0.12, 0.2, 10.0)),
    )
    return stack_bond_graph(Hysteretic(capacitor), sensors=("x", "i"))


def record(model: CasadiModel, time: FloatArray, u: FloatArray, u_next: FloatArray) -> Any:
    """Run `model` along a record, sample by sample, in one compiled loop."""
    n = time.size - 1
    run = model.step(time[1] - time[0], options=TIGHT).mapaccum("run", n, *CARRIED)
    return run(
        t=time[None, :-1], x=ca.DM(model.names.start), m=ca.DM(model.names.virgin), u=u[None],
        u_next=u_next[None], p=model.parameters(), z_guess=ca.DM(model.names.guess),
    )  # fmt: skip


MODELS = [rlc, lambda: stack_bond_graph(sensors=("x", "i"))]


@pytest.mark.parametrize("plugin", ["cvodes", "idas"])
@pytest.mark.parametrize("make", MODELS)
def test_integrators_take_the_linear_models_straight(plugin: str, make: Any) -> None:
    graph = make()
    model = casadi_functions(program(graph))
    time = np.linspace(0.0, 2e-3, 201)
    name, n = model.names.inputs[0], len(model.names.states)
    expected = simulate(graph, time, {name: np.full(201, 50.0)}, x0=np.zeros(n))
    solver = ca.integrator("solver", plugin, model.dae, 0.0, time[1:], TIGHT)
    states = solver(x0=0.0, u=50.0, p=model.packed())["xf"]
    y = model.rhs.map(200)(x=states, u=50.0, p=model.parameters())["y"].full()
    _same_readings(model, y, expected, 1e-6)


@pytest.mark.parametrize("make", MODELS)
def test_records_run_in_one_call(make: Any) -> None:
    graph = make()
    model = casadi_functions(program(graph))
    time: FloatArray = np.linspace(0.0, 2e-3, 201)
    volt = 50.0 * np.sin(2 * np.pi * 1000.0 * time)
    name, n = model.names.inputs[0], len(model.names.states)
    expected = simulate(graph, time, {name: volt}, x0=np.zeros(n))
    _same_readings(model, record(model, time, volt[:-1], volt[1:])["y"].full(), expected, 1e-6)
    held = simulate(graph, time, {name: volt}, x0=np.zeros(n), hold="hold")
    _same_readings(model, record(model, time, volt[:-1], volt[:-1])["y"].full(), held, 1e-6)


def _same_readings(model: CasadiModel, y: FloatArray, expected: Any, tolerance: float) -> None:
    for row, reading in enumerate(model.names.outputs):
        span = np.ptp(expected[reading])
        assert span > 1e-6
        assert np.abs(y[row] - expected[reading][1:]).max() < tolerance * span, reading


def test_memory_steps_as_the_simulation_does_with_minor_loops() -> None:
    graph = slipping_stack()
    model = casadi_functions(program(graph))
    assert len(model.names.memory) == 3
    coarse = np.arange(201) * 2e-4
    sampled = 40.0 * (1 - np.cos(100 * np.pi * coarse)) + 12.0 * np.sin(700 * np.pi * coarse)
    assert np.count_nonzero(np.diff(np.sign(np.diff(sampled)))) > 20
    expected = simulate(graph, coarse, {"V_in": sampled}, x0=np.zeros(3), accuracy=1e-7)
    errors = []
    # memory is advanced once a step: a turn of the charge within a step is seen at its end
    for steps in (4, 16):
        time: FloatArray = np.linspace(0.0, coarse[-1], 200 * steps + 1)
        volt = np.interp(time, coarse, sampled)
        found = record(model, time, volt[:-1], volt[1:])
        y = found["y"].full()[:, steps - 1 :: steps]
        expected_y = np.array([expected[n][1:] for n in model.names.outputs])
        errors.append(np.abs(y - expected_y).max(axis=1) / np.ptp(expected_y, axis=1))
    slips = found["m_next"].full()
    assert (np.ptp(slips, axis=1)[:2] > 0).all()
    assert (errors[1] < errors[0] / 2).all()
    assert (errors[1] < [3e-3, 5e-5]).all()


def test_memory_matters_in_that_test() -> None:
    graph = slipping_stack()
    model = casadi_functions(program(graph))
    virgin = ca.DM(model.names.virgin)
    x = ca.DM([3e-6, 0.0, 0.0])
    after = model.advance(x=x, p=model.parameters(), m=virgin)["m_next"]
    fresh = model.rhs(x=0.0, p=model.parameters(), m=virgin)["dx"]
    left = model.rhs(x=0.0, p=model.parameters(), m=after)["dx"]
    assert float(ca.norm_inf(fresh)) == 0.0
    assert float(ca.norm_inf(left)) > 1e-6


def test_an_operator_alone_is_exact_sample_by_sample() -> None:
    graph = stack_ang()
    model = casadi_functions(program(graph))
    time = 1e-3 * np.arange(801, dtype=np.float64)
    volt = 50.0 * (1 - np.cos(8 * np.pi * time) * np.exp(-time))
    found = record(model, time, volt[:-1], volt[1:])["y"].full()[0]
    expected = simulate(graph, time, {"V_in": volt})["x"]
    assert np.abs(found - expected[1:]).max() < 1e-13 * np.ptp(expected)


def test_without_states_there_is_nothing_to_integrate() -> None:
    with pytest.raises(UnusableInput, match="no states, so there is nothing to integrate"):
        _ = casadi_functions(program(stack_ang())).dae


@pytest.mark.parametrize("plugin", ["idas", "cvodes", "collocation"])
def test_algebraic_loop_is_solved_by_every_integrator(plugin: str) -> None:
    model = casadi_functions(cubic_loop())
    time = np.linspace(0.0, 5.0, 101)
    u = np.sin(3.0 * time)
    options = {} if plugin == "collocation" else {"abstol": 1e-12, "reltol": 1e-10}
    run = model.step(0.05, plugin, options).mapaccum("run", 100, *CARRIED)
    found = run(x=0.5, u=u[None, :-1], u_next=u[None, 1:], p=model.parameters())
    # a fine Runge-Kutta of the closed form: z by Cardano's formula
    x, states = 0.5, []
    for a, b in pairwise(u):
        for k in range(4):
            h = 0.05 / 4
            left, right = a + (b - a) * k / 4, a + (b - a) * (k + 1) / 4
            k1 = _rate(x, left)
            k2 = _rate(x + h / 2 * k1, (left + right) / 2)
            k3 = _rate(x + h / 2 * k2, (left + right) / 2)
            x += h / 6 * (k1 + 2 * k2 + 2 * k3 + _rate(x + h * k3, right))
        states.append(x)
    assert found["x_next"].full()[0] == pytest.approx(np.array(states), abs=1e-8)
    z = found["z"].full()[0]
    assert z + z**3 - states - u[1:] == pytest.approx(np.zeros(100), abs=1e-7)


def _rate(x: float, u: float) -> float:
    half = (x + u) / 2
    root = np.sqrt(half**2 + 1 / 27)
    return float(np.cbrt(half + root) + np.cbrt(half - root)) - x


def test_the_dae_dictionary_goes_straight_to_idas() -> None:
    model = casadi_functions(cubic_loop())
    assert set(model.dae) == {"t", "x", "z", "u", "p", "ode", "alg"}
    solver = ca.integrator("solver", "idas", model.dae, 0.0, 1.0, TIGHT | {"abstol": 1e-12})
    first = model.rhs(x=0.5, u=0.3, p=model.parameters())["z"]
    found = solver(x0=0.5, z0=first, u=0.3, p=model.packed())
    solver = ca.integrator("solver", "cvodes", model.ode, 0.0, 1.0, TIGHT | {"abstol": 1e-12})
    assert float(solver(x0=0.5, u=0.3, p=model.packed())["xf"]) == pytest.approx(
        float(found["xf"]), rel=1e-8
    )


@pytest.mark.parametrize("plugin", ["cvodes", "collocation"])
def test_loops_of_a_graph_balance_along_a_record(plugin: str) -> None:
    with BondGraph("loop") as g:
        loop, node = One("loop"), Zero("node")
        _ = Se("V") >> loop >> R("R_1", 10.0, law=Polynomial())
        _ = loop >> R("R_2", 5.0, law=Polynomial())
        _ = loop >> node >> C("C_1", 1e-3)
        _ = node >> R("R_3", 3.0, law=Polynomial())
        _ = node >> De("y")
        _ = loop >> Df("i")
    model = casadi_functions(program(g))
    assert model.names.algebraic
    p = model.parameters({"a_3_R_1": 0.7, "a_3_R_2": 0.4, "a_3_R_3": 0.9})
    time = np.arange(501) * 4e-5
    volt = 10.0 * np.sin(300.0 * time)
    options = {} if plugin == "collocation" else {"abstol": 1e-12, "reltol": 1e-10}
    step = model.step(4e-5, plugin, options)
    run = step.mapaccum("run", 500, *CARRIED)
    found = run(u=volt[None, :-1], u_next=volt[None, 1:], p=p)["y"].full()
    e, i = (found[model.names.outputs.index(n)] for n in ("y", "i"))
    assert volt[1:] == pytest.approx(e + 15.0 * i + 1.1 * i**3, abs=1e-9)
    # the charge of the node by Simpson's rule from what flows in and out of it
    leak = np.array([np.roots([0.9, 0.0, 3.0, -v])[-1].real for v in e])
    charge = cumulative_simpson(i - leak, dx=4e-5, initial=0.0)
    assert charge == pytest.approx(1e-3 * (e - e[0]), abs=3e-5 * np.ptp(1e-3 * e))


@pytest.mark.parametrize("size", [1e-12, 1e-3, 1.0, 1e6, -1e12])
def test_unknowns_of_any_size_are_solved_to_rounding(size: float) -> None:
    model = casadi_functions(cubic_loop())
    z = float(model.rhs(x=size, u=0.0, p=model.parameters())["z"])
    assert z + z**3 == pytest.approx(size, rel=1e-13)


def test_derivatives_go_through_the_loop() -> None:
    model = casadi_functions(cubic_loop())
    x = ca.MX.sym("x")
    z = model.rhs(x=x, u=0.2, p=model.parameters())["z"]
    slope = ca.Function("slope", [x], [ca.jacobian(z, x), z])
    found, value = (float(v) for v in slope(1.0))
    assert found == pytest.approx(1 / (1 + 3 * value**2), rel=1e-9)


def test_time_since_the_memory_reaches_timed_laws_within_the_dae() -> None:
    model = casadi_functions(program(slipping_stack()))
    packed = model.packed({"R_e": 7.0}, memory=(1e-7, 2e-7, 3e-7), since=0.25).full().ravel()
    n = len(model.names.parameters)
    assert packed[n:].tolist() == [1e-7, 2e-7, 3e-7, 0.25]
    assert packed[model.names.parameters.index("R_e")] == 7.0


@pytest.mark.parametrize("make", [lambda: program(slipping_stack()), cubic_loop])
def test_saved_models_are_the_same(make: Any, tmp_path: Path) -> None:
    model = casadi_functions(make())
    again = load(model.save(tmp_path / "deep" / "model.json"))
    assert again.names == model.names
    at = {"x": 1e-6, "u": 3.0, "p": model.parameters(), "m": ca.DM(model.names.virgin)}
    for name in ("rhs", "advance"):
        a, b = getattr(model, name)(**at), getattr(again, name)(**at)
        assert all(ca.is_equal(a[k], b[k]) for k in a)
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["model.json"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "is not JSON"),
        ("[]", "is no file of bondsight.casadi/1"),
        ('{"schema": "bondsight.casadi/1"}', "not readable by"),
        ('{"schema": "bondsight.casadi/1", "names": {"nam": 1}}', "not readable by"),
    ],
)
def test_foreign_files_are_refused_in_one_line(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "model.json"
    file.write_text(text)
    with pytest.raises(UnusableInput, match=words) as caught:
        load(file)
    assert "\n" not in str(caught.value)


def test_a_damaged_function_is_refused(tmp_path: Path) -> None:
    file = casadi_functions(cubic_loop()).save(tmp_path / "model.json")
    data = json.loads(file.read_text())
    data["equations"] = data["equations"][:40]
    file.write_text(json.dumps(data))
    with pytest.raises(UnusableInput, match="export the model again"):
        load(file)
    with pytest.raises(UnusableInput, match="check the path"):
        load(tmp_path / "absent.json")


def test_unknown_parameters_and_steps_are_named() -> None:
    model = casadi_functions(cubic_loop())
    with pytest.raises(UnknownName, match="no parameter 'kk' in cubic_loop"):
        model.parameters({"kk": 1.0})
    with pytest.raises(UnusableInput, match="positive interval"):
        model.step(0.0)
