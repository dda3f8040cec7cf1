"""The general integrator: order, stiffness, unknowns, memory, and loud failure."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from actuators.stack.bond_graph import stack_bond_graph
from bondgraph import (
    BondGraph,
    BondsightError,
    C,
    Df,
    Dq,
    I,
    One,
    R,
    Se,
    Sf,
    UnusableInput,
    Zero,
    simulate,
)
from bondgraph.energy.bond_power import observables
from bondgraph.energy.ledger import ledger
from bondgraph.equations.codegen import program
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import MTF, MSe
from bondgraph.graph.modulation import TIME, displacement, effort
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Hysteretic, Polynomial, SlewLimit, StopSum
from bondgraph.simulation.radau.start import rest
from bondgraph.simulation.simulate import simulate_general
from tests.bondgraph.simulation.general_reference import Runner


def pendulum() -> BondGraph:
    with BondGraph("pendulum") as g:
        turn, lift = One("turn"), One("lift")
        Se("T") >> turn >> I("J", 1.0)
        turn >> C("phi", stiffness=0.5)
        lever = MTF("lever", ratio=sp.sin(displacement("phi")))
        turn >> lever
        lever >> lift >> R("b", 0.3)
        lift >> I("m", 0.4)
        turn >> Df("w")
    return g


def reference(
    g: BondGraph, t: np.ndarray, u: Callable[[float], float], x0: np.ndarray
) -> np.ndarray:
    made = program(g)
    p = list(made.nominal)

    def rate(at: float, x: np.ndarray) -> np.ndarray:
        return np.asarray(made.rhs(at, x, [], [u(at)], p, [], 0)[0].full()).ravel()

    found = solve_ivp(rate, (t[0], t[-1]), x0, t_eval=t, rtol=1e-11, atol=1e-12, method="DOP853")
    return np.asarray(found.y.T)


def test_order_three() -> None:
    g = pendulum()
    t = np.linspace(0.0, 4.0, 41)
    u = np.zeros_like(t)
    x0 = np.array([0.5, 1.0])
    right = reference(g, t, lambda _: 0.0, x0)
    made = program(g)
    runner, p = Runner(made), np.array(made.nominal)
    errors = []
    for n_sub in (2, 4, 8, 16):
        found, _ = runner(t, 0.1, u[:, None], p, x0, np.zeros(0), np.zeros(0), n_sub)
        assert found is not None
        errors.append(np.abs(found.x - right).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(3.0, abs=0.2)


def test_against_an_independent_integrator() -> None:
    g = pendulum()
    t = np.linspace(0.0, 5.0, 2001)
    torque = np.sin(2 * t)
    x0 = np.array([0.1, 0.4])
    found = simulate(g, t, {"T": torque}, x0=x0, hold="linear", accuracy=1e-6)
    right = reference(g, t, lambda at: float(np.sin(2 * at)), x0)
    w = right[:, program(g).states.index("p_J")] / 1.0
    assert found["w"] == pytest.approx(w, abs=2e-5 * np.abs(w).max())


def test_both_integrators_agree_on_the_stiff_stack() -> None:
    g = stack_bond_graph(sensors=("x", "i"))
    t = np.linspace(0.0, 5e-3, 1001)
    v = 50.0 * (1 - np.cos(2 * np.pi * 300 * t))
    exact = simulate(g, t, {"V_in": v})
    general = simulate_general(g, t, {"V_in": v}, accuracy=1e-6)
    for n in ("x", "i"):
        span = np.abs(exact[n]).max()
        assert general[n] == pytest.approx(exact[n], abs=1e-5 * span)


def test_both_integrators_agree_on_minor_loops_of_the_hysteretic_stack() -> None:
    slope = 1 / (1.65e-6 * 18e-3**2)
    law = Hysteretic(
        PrandtlIshlinskii((0.0, 2e-7, 6e-7), tuple(slope * w for w in (1.2, -0.15, -0.1)))
    )
    g = stack_bond_graph(law, sensors=("x", "i"))
    t = np.linspace(0.0, 4e-2, 4001)
    v = 60 * np.sin(2 * np.pi * 50 * t) * (1 + 0.6 * np.sin(2 * np.pi * 175 * t))
    exact = simulate(g, t, {"V_in": v}, accuracy=1e-6)
    general = simulate_general(g, t, {"V_in": v}, accuracy=1e-5)
    span = np.ptp(exact["x"])
    assert general["x"] == pytest.approx(exact["x"], abs=2e-4 * span)
    for a, b in zip(exact.memory["C_nl"], general.memory["C_nl"], strict=True):
        assert a == pytest.approx(b, rel=1e-3, abs=1e-9)


def test_extreme_stiffness_costs_nothing() -> None:
    """MSe makes the general path take a linear model with rates of 1 and 1e9 per second."""
    with BondGraph("stiff") as g:
        loop = One("loop")
        Se("V") >> loop >> R("r", 1.0)
        loop >> I("L", 1e-9)
        loop >> C("c", 1.0)
        MSe("none", value=0.0 * effort("c") + 1e-3 * effort("c") ** 2) >> loop
        loop >> Df("i")
    t = np.linspace(0.0, 5.0, 101)
    found = simulate(g, t, {"V": np.ones_like(t)}, x0=np.zeros(2))
    assert found["i"][2:] == pytest.approx(np.exp(-t[2:]), abs=5e-3)


def test_a_nonlinear_loop_is_solved_inside_the_step() -> None:
    with BondGraph("drag") as g:
        loop = One("loop")
        Se("V") >> loop >> R("r", 2.0)
        loop >> R("d", 0.0, law=Polynomial())
        loop >> C("c", 1.0)
        loop >> Df("i")
    cubic = "a_3_d"
    t = np.linspace(0.0, 3.0, 301)
    drive = {"V": np.sin(3 * t)}
    found = simulate(g, t, drive, {cubic: 0.8}, x0=np.zeros(1), hold="linear", accuracy=1e-7)
    made = program(g)
    p = np.array(made.nominal)
    p[made.parameters.index(cubic)] = 0.8

    def rate(at: float, q: np.ndarray) -> list[float]:
        drive = np.interp(at, t, np.sin(3 * t)) - q[0]
        roots = np.roots([0.8, 0.0, 2.0, -drive])
        return [float(roots[np.argmin(np.abs(roots.imag))].real)]

    right = solve_ivp(rate, (0, 3), [0.0], t_eval=t, rtol=1e-9, atol=1e-11, max_step=0.01)
    i = np.array([rate(at, q)[0] for at, q in zip(t, right.y.T, strict=True)])
    assert found["i"] == pytest.approx(i, abs=2e-5)


def test_rest_is_found_or_said_not_to_be() -> None:
    made = program(pendulum())
    x, z = rest(made, np.zeros(1), np.array(made.nominal))
    assert x == pytest.approx(np.zeros(2), abs=1e-9)
    assert z.size == 0
    with BondGraph("pushed") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        MSe("push", value=1.0 + effort("m") * 0.0 + displacement("k") ** 2) >> body
        body >> C("k", stiffness=1.0)
    with pytest.raises(BondsightError, match=r"pushed: no rest .* x0"):
        simulate(g, np.linspace(0, 1, 11), {"F": np.zeros(11)})


def test_failure_is_loud() -> None:
    """q' = q^2 reaches infinity at t = 1."""
    with BondGraph("blow_up") as g:
        loop = One("loop")
        MSe("e", value=displacement("c") ** 2 + effort("c")) >> loop
        loop >> R("r", 1.0)
        loop >> C("c", 1.0)
    with pytest.raises(BondsightError, match=r"blow_up: .*(converge|settle)"):
        simulate(g, np.linspace(0, 2, 21), {}, x0=np.ones(1))


def test_bad_input_is_one_line() -> None:
    g = pendulum()
    t = np.linspace(0, 1, 11)
    with pytest.raises(UnusableInput, match="x0 has shape"):
        simulate(g, t, {"T": t}, x0=np.zeros(5))
    with pytest.raises(UnusableInput, match="NaN"):
        simulate(g, t, {"T": t * np.nan}, x0=np.zeros(2))
    with pytest.raises(BondsightError, match="no input 'U'"):
        simulate(g, t, {"U": t}, x0=np.zeros(2))


def test_states_by_name_mean_the_same_on_both_integrators() -> None:
    with BondGraph("pair") as g:
        body = One("body")
        Se("u") >> body >> I("A", 1.0)
        body >> I("B", 3.0)
        body >> R("r", 1.0)
        body >> Df("v")
    t = np.linspace(0, 1, 101)
    for run in (simulate, simulate_general):
        found = run(g, t, {"u": 0 * t}, x0={"p_A": 1.0}, accuracy=1e-6)
        assert found["v"] == pytest.approx(np.exp(-t / 4), abs=1e-5)
    with pytest.raises(BondsightError, match="no state 'p_C'"):
        simulate(g, t, {"u": 0 * t}, x0={"p_C": 1.0})


def test_every_start_of_a_monotone_loop_is_found() -> None:
    with BondGraph("cubic") as g:
        node = Zero("node")
        Sf("u") >> node >> R("r", 1.0, law=Polynomial(orders=(3,)))
        node >> C("c", 1.0)
    t = np.linspace(0, 0.1, 3)
    for q in np.linspace(-1, 1, 21):
        simulate_general(g, t, {"u": 0 * t}, {"a_3_r": 0.4}, x0=np.array([q]))


def test_a_loop_without_states_runs() -> None:
    with BondGraph("static") as g:
        loop = One("loop")
        Se("V") >> loop >> R("N", 1.0, law=Polynomial(orders=(3,)))
        loop >> R("P", 1.0)
        loop >> Df("i")
    t = np.linspace(0, 1, 11)
    for run in (simulate, simulate_general):
        i = run(g, t, {"V": t}, {"a_3_N": 1.0}, hold="linear")["i"]
        assert 2 * i + i**3 == pytest.approx(t, abs=1e-9)


def test_dead_time_is_simulated() -> None:
    with BondGraph("late") as g:
        g.parameter("T", 0.25, "s")
        body = One("body")
        Se("F") >> body >> R("r", 2.0)
        body >> Df("v", delay="T")
    t = np.linspace(0, 1, 101)
    v = simulate(g, t, {"F": np.sin(3 * t)}, hold="linear")["v"]
    later = np.where(t < 0.25, 0.0, np.sin(3 * (t - 0.25)) / 2)
    assert v[35:] == pytest.approx(later[35:], abs=1e-6)
    with pytest.raises(UnusableInput, match="v has a dead time"):
        program(g)


def test_a_run_that_does_not_settle_says_so() -> None:
    """Two samples a period of a cubic spring's free swing are too few for two sub-steps."""
    from bondgraph.simulation.exact_run import settle
    from bondgraph.simulation.lure import compile_model

    with BondGraph("coarse") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> C("k", stiffness=1.0, law=Polynomial(orders=(3,)))
        body >> Df("v")
    model = compile_model(g)
    p = model.vector({"a_3_k": 5.0})
    arguments = (model, p, np.zeros((21, 1)), 1.5, np.array([1.0, 0.0]), "linear", 1e-4)
    n_sub, run = settle(*arguments, largest=2)
    assert (n_sub, run.settled) == (2, False)
    t = np.arange(21) * 1.5
    with pytest.warns(UserWarning, match="256 sub-steps a sample the outputs still change"):
        told = simulate(g, t, {"F": 0 * t}, {"a_3_k": 500.0}, x0=np.ones(2))
    assert "not settled" in repr(told)


def test_signals_beside_the_sensors_and_no_sensor_at_all() -> None:
    """The same motion, whether a signal is read by a sensor, is asked for, or is the state."""
    law = Hysteretic(PrandtlIshlinskii((0.0, 0.2), (2.0, -0.5)))

    def model(*, read: bool) -> BondGraph:
        with BondGraph("observed") as g:
            body = One("body")
            Se("F") >> body >> I("m", 1.0)
            body >> C("k", law=law)
            MSe("push", value=0.1 * displacement("k") ** 2) >> body
            if read:
                body >> Df("v")
        return g

    t = np.linspace(0.0, 6.0, 301)
    drive = {"F": np.sin(t)}
    read = simulate(model(read=True), t, drive, x0=np.zeros(2), observed=("p_m",))
    bare = simulate(model(read=False), t, drive, x0=np.zeros(2), observed=("p_m",))
    assert set(read.outputs) == {"v", "p_m"}
    assert set(bare.outputs) == {"p_m"}
    assert read["p_m"] == pytest.approx(read["v"], rel=1e-12)
    assert bare["p_m"] == pytest.approx(read["v"], abs=1e-6)
    assert bare.memory["k"] == pytest.approx(read.memory["k"], abs=1e-6)


@pytest.mark.parametrize("x0", [None, "rest"])
def test_laws_begin_as_in_the_exact_step(x0: str | None) -> None:
    """Stops are relaxed where the spring rests, a limited rate has arrived."""
    t, values = 1e-2 * np.arange(60), {"h_1_k": 200.0, "h_2_k": 100.0}
    force = {"F": 10.0 + np.sin(9.0 * t)}
    runs = []
    for product in ([], [MSe("G", value=1e-12 * displacement("k") ** 2)]):
        with BondGraph("late") as g:
            body = One("body")
            Se("F", drive=Drive(law=SlewLimit(0.05))) >> body >> I("m", 1.0)
            body >> C("k", stiffness=100.0, law=StopSum((0.01, 0.05)))
            body >> R("d", 5.0)
            body >> Dq("x")
        g = g.with_branch("body", product)
        runs.append(simulate(g, t, force, values, x0=x0, hold="linear", accuracy=1e-6)["x"])
    assert runs[1] == pytest.approx(runs[0], abs=1e-4 * np.ptp(runs[0]))
    assert runs[1][0] == pytest.approx(0.1 if x0 else 0.0, rel=1e-9)


def test_time_counts_from_the_first_sample() -> None:
    """As the documentation of `TIME`, energy and a study say."""
    with BondGraph("shaken") as g:
        body = One("body")
        MSe("F", value=sp.sin(5 * TIME)) >> body >> I("m", 0.1)
        body >> R("d", 2.0)
        body >> Df("v")
    t, x0 = 1e-2 * np.arange(101), {"p_m": 0.0}
    runs = [simulate(g, t + at, x0=x0, observed=observables(g)) for at in (0.0, 5.3)]
    assert runs[1]["v"] == pytest.approx(runs[0]["v"], abs=1e-9)
    assert ledger(g, runs[1]).closes
