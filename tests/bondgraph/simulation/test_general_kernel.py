"""The general kernel: values as the integrator's, tangents as differences, speed, failure."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp

from actuators.stack.bond_graph import stack_bond_graph
from bondgraph import BondGraph, C, De, Df, Dq, I, One, R, Se, Sf, UnusableInput, Zero
from bondgraph.equations.codegen import program
from bondgraph.equations.program import Program
from bondgraph.graph.elements import MTF, RE, CField, MSe
from bondgraph.graph.modulation import TIME, displacement, effort, port_variables
from bondgraph.hysteresis import BoucWen, LogCreep, MaxwellResistiveCapacitor, PrandtlIshlinskii
from bondgraph.laws import (
    Coulomb,
    Hysteretic,
    Law,
    LuGre,
    Polynomial,
    QuadraticDrag,
    Sliding,
    StopSum,
    Stribeck,
)
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import compile_model
from bondgraph.simulation.radau.native import GeneralRun, prepare_general, run_general
from bondgraph.simulation.radau.start import inputs_of
from bondgraph.simulation.start import fine_inputs
from bondgraph.support.arrays import Array
from bondgraph.support.native import compiler
from tests.beside import beside
from tests.bondgraph.simulation.general_reference import Runner
from tests.counted import calls
from tests.spring import spring

STEP = 0.02


def slider_crank() -> BondGraph:
    with BondGraph("crank") as g:
        length = g.parameter("L", 0.5)
        turn, slide = One("turn"), One("slide")
        Se("F") >> turn >> I("J", 0.1)
        turn >> C("phi", stiffness=1.0)
        turn >> MTF("crank", ratio=-length * sp.sin(displacement("phi"))) >> slide
        slide >> I("m", 1.0)
        slide >> R("b", 0.2)
        turn >> Df("w")
    return g


def silverbox() -> BondGraph:
    """Mass on a hardening spring; a Kelvin-Voigt element feels y y', so damping holds y^2 v."""
    with BondGraph("silverbox") as g:
        body, inner = One("body"), One("inner")
        Se("F") >> body >> I("m", 1.0)
        body >> R("d", 0.3)
        body >> C("k", stiffness=2.0, law=Polynomial(orders=(2, 3)))
        body >> MTF("lever", ratio=displacement("k")) >> inner
        inner >> C("k_phi", stiffness=0.7)
        inner >> R("c_phi", 0.5)
        body >> Dq("y")
    return g


def duffing() -> BondGraph:
    with BondGraph("duffing") as g:
        g.parameter("f_0", 0.0, "N", positive=False)
        body = One("body")
        Se("F", offset="f_0") >> body >> I("m", 1.3)
        body >> R("d", 0.4)
        body >> C("k", stiffness=3.0, law=Polynomial(orders=(2, 3, 4)))
        body >> Dq("y")
    return g


def cubic_loop() -> BondGraph:
    """The current solves ``2 i + a_3 i^3 = V - q/c``, and another loop the node behind it."""
    with BondGraph("loop") as g:
        loop = One("loop")
        Se("F") >> loop >> R("r", 2.0)
        loop >> R("d", 0.0, law=Polynomial(orders=(3,)))
        loop >> C("c", 1.0)
        loop >> Df("i")
    return g


def resonator(spring: Law | None = None, friction: Law | None = None) -> BondGraph:
    """Oscillator with a modulated source, which the exact step does not take."""
    with BondGraph("resonator") as g:
        g.parameter("a", 0.2, "N")
        body = One("body")
        Se("F") >> body >> I("m", 1.3)
        body >> R("d", beside(friction, 0.4), law=friction)
        body >> C("k", stiffness=beside(spring, 3.0), law=spring)
        MSe("push", value=sp.Symbol("a", positive=True) * sp.sin(TIME) * effort("k")) >> body
        body >> Dq("x")
        body >> Df("v")
    return g


def fed_store() -> BondGraph:
    """A source straight on a capacitor: the equations need the rate of the input."""
    with BondGraph("fed") as g:
        node, loop = Zero("node"), One("loop")
        Se("F") >> loop >> node >> C("c", 0.8)
        node >> R("r", 2.0, law=QuadraticDrag(0.3))
        loop >> Df("i")
        node >> De("v")
    return g


PLAYS = PrandtlIshlinskii((0.0, 0.05, 0.2), (2.0, 0.7, 0.3))
MODELS: dict[str, Callable[[], BondGraph]] = {
    "slider-crank": slider_crank,
    "silverbox": silverbox,
    "duffing": duffing,
    "implicit loop": cubic_loop,
    "time and modulation": resonator,
    "Bouc-Wen": lambda: resonator(Hysteretic(BoucWen(0.5, 1.2, 1.5, 0.6, 0.3))),
    "plays": lambda: resonator(Hysteretic(PLAYS)),
    "creep": lambda: resonator(Hysteretic(LogCreep((5.0, 0.5), (0.0, 0.4), (0.5, 0.8)))),
    "sliding": lambda: resonator(None, Sliding(MaxwellResistiveCapacitor((3.0, 2.0), (0.1, 0.3)))),
    "LuGre": lambda: resonator(None, LuGre(0.3, 0.2, 0.3, 40.0, 0.2)),
    "rate of an input": fed_store,
}


@cache
def model(name: str) -> Program:
    return program(MODELS[name]())


def point(made: Program) -> Array:
    """Parameters away from zero, so that zero starts hide nothing."""
    return np.array([v or 0.3 + 0.05 * i for i, v in enumerate(made.nominal)])


def inputs(made: Program, n: int, step: float = STEP) -> Array:
    t = step * (np.arange(n) + 3)
    return inputs_of(made, {"F": 1.2 * np.sin(2.1 * t) + 0.7 * np.sin(5.3 * t)}, t)


def start(made: Program) -> Array:
    return np.array([0.21, -0.13, 0.05, 0.02][: len(made.states)])


def difference(run: Callable[[float], Array], h: float = 1e-6) -> Array:
    return np.asarray((run(h) - run(-h)) / (2 * h))


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", MODELS)
def test_values_are_those_of_the_integrator(name: str) -> None:
    made = model(name)
    n = 101
    p, u, x0 = point(made), inputs(made, n), start(made)
    t, m0 = STEP * np.arange(n), np.array(made.virgin)
    begin = run_general(prepare_general(made, p, STEP), u[:1], x0)
    right, _ = Runner(made)(t, STEP, u, p, x0, begin.z, m0, 4)
    assert right is not None
    found = run_general(prepare_general(made, p, STEP, 4), u, x0)
    assert found.settled
    assert found.y.shape == right.y.shape
    size = np.abs(right.y).max(axis=0)
    # laws that depend on time are read at the end of the step, the integrator reads them at once
    late = 1e-9 if not any(c.law.timed for c in made.laws) else 1e-3
    assert (np.abs(found.y - right.y) <= late * size).all()
    assert found.x == pytest.approx(right.x[-1], rel=1e-7, abs=1e-9)
    assert found.z == pytest.approx(right.z[-1], rel=1e-7, abs=1e-9)
    kept = [v for c in made.laws if c.law.n_memory for v in found.memory[c.element]]
    assert kept == pytest.approx(right.memory.tolist(), rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_tangents_against_central_differences(name: str) -> None:
    made = model(name)
    n, n_p, n_x = 121, len(made.parameters), len(made.states)
    p, u, x0 = point(made), inputs(made, n), start(made)
    ready = prepare_general(made, p, STEP, 2, range(n_p), True, memory_directions=True)
    # a virgin memory often lies on a kink; that of an earlier run does not
    used = run_general(prepare_general(made, p, STEP, 2), u[:31], x0).memory
    run = run_general(ready, u, x0, memory=used)
    assert run.dy.shape == (n, len(made.outputs), n_p + n_x + len(made.memory))
    plain = run_general(prepare_general(made, p, STEP, 2), u, x0, memory=used)
    np.testing.assert_array_equal(run.y, plain.y)
    assert run.dx.shape == (n_x, ready.n_d)
    kept = np.array([v for c in made.laws if c.law.n_memory for v in used[c.element]])

    def shifted(d: int, h: float) -> GeneralRun:
        q, x, m = p.copy(), x0.copy(), kept.copy()
        column, at = ((q, d), (x, d - n_p), (m, d - n_p - n_x))[(d >= n_p) + (d >= n_p + n_x)]
        column[at] += h
        memory = {c.element: m[c.memory].tolist() for c in made.laws if c.law.n_memory}
        return run_general(prepare_general(made, q, STEP, 2), u, x, memory=memory)

    for d in range(ready.n_d):
        central = difference(lambda h, d=d: shifted(d, h).y)  # type: ignore[misc]
        error = np.abs(run.dy[:, :, d] - central)
        size = max(float(np.abs(central).max()), 1e-2)
        assert np.quantile(error, 0.9) < 1e-6 * size, d
        assert error.max() < 2e-5 * size, d
        end = difference(lambda h, d=d: shifted(d, h).x)  # type: ignore[misc]
        assert run.dx[:, d] == pytest.approx(end, rel=2e-5, abs=2e-5 * size)


@pytest.mark.parametrize("name", MODELS)
def test_without_a_compiler(name: str, monkeypatch: Any) -> None:
    made = model(name)
    n = 151  # longer than a chunk, with a remainder
    u, x0 = inputs(made, n), start(made)
    ready = prepare_general(made, point(made), STEP, 1, (0, len(made.parameters) - 1), True, True)
    native = run_general(ready, u, x0)
    monkeypatch.setenv("BONDSIGHT_NO_COMPILER", "1")
    machine = run_general(ready, u, x0)
    assert machine.settled
    for field in ("y", "dy", "x", "z", "dx", "dmemory"):
        a, b = getattr(native, field), getattr(machine, field)
        size = max(1.0, np.abs(a).max(initial=0.0))
        np.testing.assert_allclose(b, a, rtol=0, atol=1e-7 * size, err_msg=field)


@pytest.mark.parametrize("name", ["slider-crank", "silverbox", "implicit loop"])
def test_order_three(name: str) -> None:
    made = model(name)
    p, n = point(made), 41
    u = np.zeros((n, 1))
    runs = [run_general(prepare_general(made, p, 0.05, 2**k), u, start(made)).y for k in range(6)]
    errors = [np.abs(y - runs[-1]).max() for y in runs[:4]]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(3.0, abs=0.2)


def test_the_hysteretic_stack_as_a_program_is_that_of_the_exact_kernel() -> None:
    """Charge and voltage differ by seven orders, rates by six."""
    slope = 1 / (1.65e-6 * 18e-3**2)
    weights = tuple(slope * w for w in (1.2, -0.15, -0.1))
    law = Hysteretic(PrandtlIshlinskii((0.0, 2e-7, 6e-7), weights))
    g = stack_bond_graph(law, sensors=("x", "i"))
    t = np.linspace(0.0, 4e-2, 2001)
    v = 60 * np.sin(2 * np.pi * 50 * t) * (1 + 0.6 * np.sin(2 * np.pi * 175 * t))
    exact_model, made = compile_model(g), program(g)
    p = np.array(made.nominal)
    places = [made.parameters.index(n) for n in exact_model.parameter_names]
    step = float(t[1])
    exact = run_record(
        exact_model, p[places], v[:, None], step, np.zeros(exact_model.n_x),
        n_sub=16, directions=range(len(places)),
    )  # fmt: skip
    ready = prepare_general(made, p, step, 8, places)
    found = run_general(ready, v[:, None], np.zeros(len(made.states)))
    assert found.settled
    x = made.outputs.index("x")
    own = exact_model.model.output_names.index("x")
    span = np.ptp(exact.y[:, own])
    assert np.abs(found.y[:, x] - exact.y[:, own]).max() < 1e-4 * span
    for d in range(len(places)):
        right = exact.dy[:, own, d]
        size = np.abs(right).max()
        error = np.abs(found.dy[:, x, d] - right)
        assert np.sqrt(np.mean(error**2)) <= 2e-3 * size, made.parameters[places[d]]
    for a, b in zip(exact.memory["C_nl"], found.memory["C_nl"], strict=True):
        assert a == pytest.approx(b, rel=1e-3, abs=1e-9)


def test_extreme_stiffness_costs_nothing() -> None:
    """Rates of 1 and 1e9 per second at a step of 0.05 s."""
    with BondGraph("stiff") as g:
        loop = One("loop")
        Se("V") >> loop >> R("r", 1.0)
        loop >> I("L", 1e-9)
        loop >> C("c", 1.0)
        MSe("none", value=1e-3 * effort("c") ** 2) >> loop
        loop >> Df("i")
    made = program(g)
    p = np.array(made.nominal)
    r = made.parameters.index("r")
    t = np.linspace(0.0, 5.0, 101)
    run = run_general(prepare_general(made, p, 0.05, 1, (r,)), np.ones((101, 1)), np.zeros(2))
    assert run.settled
    assert run.y[2:, 0] == pytest.approx(np.exp(-t[2:]), abs=5e-3)
    # i = exp(-t/r)/r, so di/dr = (t - 1) exp(-t) at r = 1
    assert run.dy[2:, 0, 0] == pytest.approx((t[2:] - 1) * np.exp(-t[2:]), abs=1e-2)


def test_silverbox_has_the_equations_meant() -> None:
    made = program(silverbox())
    p = dict(zip(made.parameters, point(made), strict=True))
    at = dict(zip(made.states, (0.4, 0.7, 0.11), strict=True))
    rate = made.rhs(0.0, list(at.values()), [], [2.0], list(p.values()), [], 0.0)[0]
    found = dict(zip(made.states, rate.full().ravel(), strict=True))
    v, y, phi = at["p_m"] / p["m"], at["q_k"], at["q_k_phi"]
    spring = p["k"] * y + p["a_2_k"] * y**2 + p["a_3_k"] * y**3
    voigt = y * (p["k_phi"] * phi + p["c_phi"] * y * v)
    assert found["q_k_phi"] == pytest.approx(y * v)
    assert found["p_m"] == pytest.approx(2.0 - p["d"] * v - spring - voigt)


def test_between_samples() -> None:
    """Held inputs jump at samples; `fine` replaces what the inputs do; sub-steps can be given."""
    g = duffing()
    made, exact_model = program(g), compile_model(g)
    p = np.array(made.nominal)
    places = [made.parameters.index(n) for n in exact_model.parameter_names]
    u = inputs(made, 61)
    both = np.column_stack([u, np.ones(61)])  # the exact step takes the offset as an input
    for hold in ("hold", "linear", "band-limited"):
        right = run_record(exact_model, p[places], both, STEP, np.zeros(2), n_sub=16, hold=hold)
        ready = prepare_general(made, p, STEP, 16)
        found = run_general(ready, u, np.zeros(2), hold)
        assert found.y == pytest.approx(right.y, abs=1e-5 * np.abs(right.y).max())
        again = run_general(ready, u, np.zeros(2), fine=fine_inputs(u, 16, hold))
        np.testing.assert_array_equal(found.y, again.y)
        every = run_general(ready, u, np.zeros(2), hold, every_substep=True)
        np.testing.assert_array_equal(every.y[::16], found.y)


def test_a_record_goes_on_from_where_it_ended() -> None:
    made = model("Bouc-Wen")
    p, u = point(made), inputs(made, 81)
    ready = prepare_general(made, p, STEP, 2, (0,))
    whole = run_general(ready, u, start(made))
    first = run_general(ready, u[:41], start(made))
    then = run_general(ready, u[40:], first.x, memory=first.memory, time=40 * STEP)
    assert then.y[1:] == pytest.approx(whole.y[41:], rel=1e-9, abs=1e-12)


def test_given_memory_tangents_enter() -> None:
    made = model("plays")
    p, u, x0 = point(made), inputs(made, 41), start(made)
    by_memory = run_general(prepare_general(made, p, STEP, 1, (), False, True), u, x0)
    weights = np.array([[0.3], [-0.2], [0.5]])[: len(made.memory)]
    mixed = run_general(prepare_general(made, p, STEP, 1, (0,)), u, x0, memory_tangent=weights)
    plain = run_general(prepare_general(made, p, STEP, 1, (0,)), u, x0)
    assert mixed.dy - plain.dy == pytest.approx(by_memory.dy @ weights, abs=1e-12)


def test_failure_is_loud_and_ends() -> None:
    """q' = q^2 reaches infinity at t = 1."""
    with BondGraph("blow_up") as g:
        loop = One("loop")
        MSe("e", value=displacement("c") ** 2 + effort("c")) >> loop
        loop >> R("r", 1.0)
        loop >> C("c", 1.0)
        loop >> Df("f")
    made = program(g)
    ready = prepare_general(made, np.array(made.nominal), 0.1, 1, (0,), True)
    run = run_general(ready, np.zeros((41, len(made.inputs))), np.ones(1))
    assert not run.settled
    assert 5 < run.reached < 20
    assert np.isfinite(run.y[: run.reached]).all()
    assert np.isnan(run.y[run.reached :]).all()
    assert np.isnan(run.dy[run.reached :]).all()
    assert np.isnan(run.x).all()


def test_a_loop_without_states_runs() -> None:
    with BondGraph("static") as g:
        loop = One("loop")
        Se("V") >> loop >> R("N", 1.0, law=Polynomial(orders=(3,)))
        loop >> R("P", 1.0)
        loop >> Df("i")
    made = program(g)
    p = np.array(made.nominal)
    cubic = made.parameters.index("a_3_N")
    p[cubic] = 1.0
    t = np.linspace(0, 1, 11)
    run = run_general(prepare_general(made, p, 0.1, 1, (cubic,)), t[:, None], np.zeros(0))
    i = run.y[:, 0]
    assert 2 * i + i**3 == pytest.approx(t, abs=1e-12)
    assert run.dy[:, 0, 0] == pytest.approx(-(i**3) / (2 + 3 * i**2), abs=1e-9)


@pytest.mark.parametrize("law", [Coulomb(0.3), Stribeck(0.3, 0.2, 0.1)])
def test_laws_that_jump_are_refused(law: Law) -> None:
    made = program(resonator(None, law))
    with pytest.raises(UnusableInput, match=r"resonator: d has a law that jumps"):
        prepare_general(made, np.array(made.nominal), STEP)


def test_bad_input_is_one_line() -> None:
    made = program(silverbox())
    p = np.array(made.nominal)
    ready = prepare_general(made, p, STEP)
    with pytest.raises(UnusableInput, match="x0 has shape"):
        run_general(ready, inputs(made, 5), np.zeros(2))
    with pytest.raises(UnusableInput, match="u has shape"):
        run_general(ready, np.zeros((5, 2)), np.zeros(3))
    with pytest.raises(UnusableInput, match="fine has shape"):
        run_general(ready, inputs(made, 5), np.zeros(3), fine=np.zeros((3, 2, 1)))
    with pytest.raises(UnusableInput, match="p has shape"):
        prepare_general(made, p[:2], STEP)
    with pytest.raises(UnusableInput, match="directions"):
        prepare_general(made, p, STEP, directions=(40,))
    fed = program(fed_store())
    ready = prepare_general(fed, np.array(fed.nominal), STEP)
    with pytest.raises(UnusableInput, match="d_F"):
        run_general(ready, inputs(fed, 5), np.zeros(len(fed.states)), "hold")


@pytest.mark.skipif(compiler() is None, reason="no gcc")
@pytest.mark.parametrize("graph", [duffing, silverbox])
def test_all_steps_with_all_directions_are_one_call_of_the_kernel(
    graph: Callable[[], BondGraph],
) -> None:
    made = program(graph())
    ready = prepare_general(made, point(made), STEP, 1, range(7), True)
    assert ready.n_d >= 9

    def work(n: int) -> int:
        return calls(lambda: run_general(ready, inputs(made, n), start(made)))

    work(11)
    assert work(20_001) == work(101) < 1000


def test_random_points_do_not_hang() -> None:
    made = program(slider_crank())
    rng = np.random.default_rng(3)
    u = 30 * rng.standard_normal((400, 1))
    for _ in range(5):
        p = np.array(made.nominal) * np.exp(rng.standard_normal(len(made.nominal)))
        run = run_general(prepare_general(made, p, 0.2, 1, (0,)), u, start(made))
        assert np.isfinite(run.y[: run.reached]).all()
        assert np.isnan(run.y[run.reached :]).all()


def test_relaxed_memory_starts_as_the_exact_step_does() -> None:
    slip = Sliding(MaxwellResistiveCapacitor((3.0, 2.0), (0.1, 0.3)))
    g = spring(1.3, 0.4, 3.0, StopSum((0.1, 0.3), height=0.7), slip)
    exact_model, made = compile_model(g), program(g)
    p = np.array(made.nominal)
    places = [made.parameters.index(n) for n in exact_model.parameter_names]
    assert exact_model.states == made.states
    u, x0 = inputs(made, 121), np.array([0.4, 0.6])
    exact = run_record(
        exact_model, p[places], u, STEP, x0, n_sub=32, directions=range(len(places)),
        state_directions=True,
    )  # fmt: skip
    ready = prepare_general(made, p, STEP, 32, places, True)
    found = run_general(ready, u, x0, relaxed=True)
    span = np.ptp(exact.y)
    assert np.abs(found.y - exact.y).max() < 1e-3 * span
    virgin = run_general(ready, u, x0)
    assert np.abs(virgin.y - exact.y).max() > 0.01 * span
    for d in range(ready.n_d):
        error = np.sqrt(np.mean((found.dy[:, 0, d] - exact.dy[:, 0, d]) ** 2))
        assert error < 0.02 * np.abs(exact.dy[:, 0, d]).max(), d

    def shifted(d: int, h: float) -> Array:
        x = x0.copy()
        x[d] += h
        return run_general(ready, u, x, relaxed=True).y

    for d in range(2):
        central = difference(lambda h, d=d: shifted(d, h))  # type: ignore[misc]
        column = found.dy[:, :, len(places) + d]
        assert np.quantile(np.abs(column - central), 0.9) < 1e-6 * np.abs(central).max()


def test_charge_and_position_of_a_moving_plate() -> None:
    """States of 1e-8 C, 1e-3 m and 1e-6 N s together, a store of two ports, a stiff circuit."""
    q, x = port_variables("q", 2)
    with BondGraph("plate") as g:
        c0, x0 = g.parameter("c0", 1e-9, "F"), g.parameter("x0", 1e-3, "m")
        device = CField("device", energy=q**2 * x / (2 * c0 * x0))
        loop, body = One("loop"), One("body")
        Se("F") >> loop >> R("R_s", 1e4)
        loop >> device
        body >> device
        body >> I("m", 1e-4)
        body >> C("k", stiffness=10.0)
        body >> R("d", 1e-3)
        loop >> Df("i")
        body >> Df("v")
    made = program(g)
    p, n, step = np.array(made.nominal), 201, 1e-4
    begin = {"q_device1": 1e-8, "q_device2": 1e-3}
    start_at = np.array([begin.get(name, 0.0) for name in made.states])
    t = step * np.arange(n)
    u = inputs_of(made, {"F": 20.0 * np.sin(400 * t) + 10}, t)
    ready = prepare_general(made, p, step, 2, range(p.size), True)
    run = run_general(ready, u, start_at)
    assert run.settled
    z0 = np.zeros(len(made.algebraic))
    right, _ = Runner(made)(t, step, u, p, start_at, z0, np.zeros(0), 2)
    assert right is not None
    assert (np.abs(run.y - right.y).max(axis=0) <= 1e-9 * np.abs(right.y).max(axis=0)).all()
    for d in range(p.size):
        h = 1e-4 * p[d]

        def shifted(h: float, d: int = d) -> Array:
            other = p.copy()
            other[d] += h
            return run_general(prepare_general(made, other, step, 2), u, start_at).y

        central = difference(shifted, h)
        size = np.maximum(np.abs(central).max(axis=0), 1e-6 * np.abs(run.y).max(axis=0) / p[d])
        assert (np.abs(run.dy[:, :, d] - central).max(axis=0) < 1e-5 * size).all(), d


def test_a_reaction() -> None:
    """Mass action is exponential in the affinities; another machine is the reference."""
    with BondGraph("reaction") as g:
        a, b = Zero("a"), Zero("b")
        a >> C("A", 1.0)
        Sf("F") >> a
        a >> RE("r", ratio=0.7) >> b
        b >> C("B", 2.0)
        b >> De("mu")
    made = program(g)
    p, u, n = np.array(made.nominal), inputs(made, 101), 101
    x0 = np.array([0.3, 0.1])
    right, _ = Runner(made)(
        STEP * np.arange(n), STEP, u, p, x0, np.zeros(len(made.algebraic)), np.zeros(0), 2
    )
    run = run_general(prepare_general(made, p, STEP, 2, range(p.size), True), u, x0)
    assert right is not None
    assert run.y == pytest.approx(right.y, rel=1e-10)
    k = made.parameters.index("r")

    def shifted(h: float) -> Array:
        other = p.copy()
        other[k] += h
        return run_general(prepare_general(made, other, STEP, 2), u, x0).y

    central = difference(shifted)
    assert run.dy[:, :, k] == pytest.approx(central, abs=1e-7 * np.abs(central).max())
