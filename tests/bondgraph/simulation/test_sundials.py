"""CVODES and IDAS: the same answers as ours, refusals, memory that is exact or said to be held."""

from __future__ import annotations

import re
import signal
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuators.models.catalogue import MODELS
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
    UnknownName,
    UnusableInput,
)
from bondgraph.equations.codegen import law_functions, program
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import X1
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Coulomb, DahlFriction, GrowingDamping, Hysteretic, Law
from bondgraph.simulation.flowing import flowing, rates_of
from bondgraph.simulation.lure import compile_model
from bondgraph.simulation.posing import pose
from bondgraph.simulation.simulate import simulate_general
from bondgraph.simulation.sundials.record import begun, march, stepper_of
from bondgraph.simulation.sundials.stepper import Stepper
from tests.benchmarks.integrators import contact
from tests.bondgraph.hysteresis.examples import CREEP, LINEAR
from tests.bondgraph.laws.test_laws import EVERY, numbers
from tests.settled import simulate

BOTH = pytest.mark.parametrize("integrator", ["cvodes", "idas"])
TIME = np.arange(101) * 1e-4
VOLT = 50.0 - 50.0 * np.cos(2 * np.pi * 100 * TIME) + 15.0 * np.sin(2 * np.pi * 330 * TIME)


def differs(found: Any, right: Any) -> float:
    """Return the largest difference of an output over its range."""
    return max(float(np.abs(found[n] - y).max() / np.ptp(y)) for n, y in right.outputs.items())


def block(
    law: Law | None = None, spring: Law | None = None, drive: Drive | None = None, **sensor: Any
) -> BondGraph:
    with BondGraph("block") as g:
        g.parameter("late", 2.3e-3, "s")
        body = One("body")
        Se("F", drive=drive) >> body >> I("m", 0.05)
        body >> C("k", stiffness=100.0, law=spring)
        body >> R("mu", 1.0, law=law)
        body >> Dq("x", **sensor)
    return g


def push(n: int = 101) -> tuple[Any, Any]:
    t = np.arange(n) * 2e-3
    return t, 3.0 * np.sin(2 * np.pi * 3 * t) + np.sin(2 * np.pi * 17 * t) + 0.5


# -- the same answers ---
@BOTH
def test_stack_with_memory(integrator: str) -> None:
    """Its linear part is exact in ours; what is left is how both follow the twelve plays."""
    graph = MODELS["stack_bond_graph_ang"]()
    exact = simulate(graph, TIME, {"V_in": VOLT}, accuracy=1e-7)
    general = simulate_general(graph, TIME, {"V_in": VOLT}, x0="rest", hold="linear", accuracy=1e-6)
    found = simulate(graph, TIME, {"V_in": VOLT}, integrator=integrator)
    assert differs(found, exact) < 2e-6
    assert differs(found, general) < 1e-4
    assert found.inner_steps > TIME.size
    assert exact.inner_steps == general.inner_steps == 0
    assert found.memory["C_nl"] == pytest.approx(exact.memory["C_nl"], rel=1e-5)
    assert dict(zip(found.states, found.state, strict=True)) == pytest.approx(
        dict(zip(exact.states, exact.state, strict=True)), rel=1e-4
    )


@BOTH
def test_memory_inside_an_algebraic_loop(integrator: str) -> None:
    graph = MODELS["stack_lumped_maxwell"]()
    assert program(graph).algebraic
    time, volt = TIME[:61], VOLT[:61]
    exact = simulate(graph, time, {"V_in": volt}, accuracy=1e-7)
    found = simulate(graph, time, {"V_in": volt}, accuracy=1e-5, integrator=integrator)
    assert differs(found, exact) < 2e-6


@pytest.mark.sampled(every=4)
@BOTH
@pytest.mark.parametrize("place", ["F", "k", "x"])
def test_memory_beside_one_state(place: str, integrator: str) -> None:
    law: dict[str, Any] = {"law": Hysteretic(PrandtlIshlinskii((0.0, 5.0), (1.0, 0.2)))}
    with BondGraph("creeping") as graph:
        tip = One("tip")
        Se("F", drive=Drive(**law) if place == "F" else None) >> tip
        tip >> R("d", 1.0)
        tip >> (C("k", **law) if place == "k" else C("k", stiffness=1.0))
        tip >> Dq("x", **(law if place == "x" else {}))
    time = 0.02 * np.arange(400)
    force = {"F": 20.0 * np.sin(time)}
    exact = simulate(graph, time, force, accuracy=1e-7)
    found = simulate(graph, time, force, accuracy=1e-5, integrator=integrator)
    assert found.states == ("q_k",)
    assert differs(found, exact) < 1e-5


@BOTH
def test_dependent_storage(integrator: str) -> None:
    """Momentum of the payload follows that of the mass; both springs of a series bear one force."""
    graph = contact()
    assert program(graph).algebraic
    assert "p_payload" not in program(graph).states
    given, seen = {"V_in": VOLT}, ("q_a", "q_b", "q_k", "f_body")
    right = simulate(graph, TIME, given, accuracy=1e-7, observed=seen)
    found = simulate(graph, TIME, given, accuracy=1e-6, observed=seen, integrator=integrator)
    assert differs(found, right) < 2e-6
    a, b = found["q_a"], found["q_b"]
    forces = [k * q + 20.0 * (q / 5e-6) ** 3 for k, q in ((2e6, a), (1e6, b))]
    assert forces[0] == pytest.approx(forces[1], abs=1e-9 * np.abs(forces[0]).max())
    assert a + b == pytest.approx(found["q_k"], abs=1e-12)


@BOTH
@pytest.mark.parametrize("hold", ["hold", "linear", "band-limited"])
def test_inputs_between_samples_are_those_of_ours(hold: str, integrator: str) -> None:
    t, force = push(51)
    right = simulate(block(), t, {"F": force}, hold=hold, accuracy=1e-7)
    found = simulate(block(), t, {"F": force}, hold=hold, integrator=integrator)
    assert differs(found, right) < 2e-4


def test_one_tolerance_serves_states_of_any_size() -> None:
    """The length of the stack scales dipole and field only: by 1e11 there is nothing to see."""
    runs = [
        simulate(
            stack_bond_graph(sensors=("x", "i"), length=length), TIME, {"V_in": VOLT},
            integrator="cvodes",
        )
        for length in (18e-3, 18e-9, 18e2)
    ]  # fmt: skip
    for run in runs[1:]:
        assert differs(run, runs[0]) < 1e-6


@BOTH
def test_starts_memory_delays_and_steps_are_those_of_simulate(integrator: str) -> None:
    graph = MODELS["stack_bond_graph_ang"]()
    time, volt = TIME[:31], VOLT[:31] + 20.0
    start = simulate(graph, time, {"V_in": volt}, accuracy=1e-6)
    found = simulate(graph, time, {"V_in": volt}, accuracy=1e-4, integrator=integrator)
    assert differs(found, start) < 1e-5
    half: dict[str, Any] = {"accuracy": 1e-4, "integrator": integrator}
    first = simulate(graph, TIME[:31], {"V_in": VOLT[:31]}, **half)
    again: dict[str, Any] = {"x0": first.state, "memory": first.memory}
    then = simulate(graph, TIME[30:61], {"V_in": VOLT[30:61]}, **half, **again)
    whole = simulate(graph, TIME[:61], {"V_in": VOLT[:61]}, **half)
    assert then["x"] == pytest.approx(whole["x"][30:], abs=1e-5 * np.ptp(whole["x"]))
    t, force = push()
    late = block(drive=Drive(delay="late"), resolution=1e-4, delay="late")
    right = simulate(late, t, {"F": force}, {"late": 3e-3})
    made = simulate(late, t, {"F": force}, {"late": 3e-3}, integrator=integrator)
    assert np.abs(made["x"] - right["x"]).max() < 1.01e-4
    assert np.mean(made["x"] != right["x"]) < 0.05


# -- memory ---
def test_turns_leave_an_error_of_high_order() -> None:
    """Without a step at every turn it would be of second order, 1e-4 at one step a sample."""
    graph = MODELS["stack_bond_graph_ang"]()
    asked = pose(graph, TIME[:61], {"V_in": VOLT[:61]}, {}, ())
    begin = begun(asked, None, None)
    stepper, begin = stepper_of(asked, begin, "cvodes", 1e-12, "linear")
    y = [march(stepper, asked, begin, "linear", n)[0][:, 0] for n in (1, 2, 6)]
    errors = [float(np.sqrt(np.mean((v - y[-1]) ** 2)) / np.ptp(y[-1])) for v in y[:-1]]
    assert errors[0] < 2e-6
    assert errors[1] < errors[0] / 5


@BOTH
def test_a_bristle_is_a_state(integrator: str) -> None:
    """Dahl's friction beside its differential equations, written by hand."""
    t, force = push()
    m, d, k, level, way = 0.05, 1.0, 100.0, 0.8, 1e-3

    def rate(at: float, s: Any) -> list[float]:
        v = s[1] / m
        moved = v - s[2] * abs(v)
        return [v, np.interp(at, t, force) - d * v - k * s[0] - level * s[2], moved / way]

    begin = [force[0] / k, 0.0, 0.0]
    right = solve_ivp(rate, (0, t[-1]), begin, "LSODA", t, rtol=1e-9, atol=1e-12, max_step=2e-3)
    graph = block(DahlFriction(level, way))
    found = simulate(graph, t, {"F": force}, accuracy=1e-6, integrator=integrator)
    assert found.steps_per_sample == 1
    assert found["x"] == pytest.approx(right.y[0], abs=1e-6 * np.ptp(right.y[0]))
    assert found.memory["mu"][0] == pytest.approx(right.y[2, -1], abs=1e-5)


FLOWING = {n: law for n, law in EVERY.items() if law.flows} | {
    "KelvinVoigtCreep": Hysteretic(LINEAR),
    "LogCreep": Hysteretic(CREEP),
}


@pytest.mark.parametrize("name", FLOWING)
def test_rates_are_those_of_short_steps(name: str) -> None:
    law = FLOWING[name]
    assert law.timed
    q = numbers(law)[:-1]
    value, advance = law_functions(law, len(q))
    own, rates = rates_of(advance)
    s = 0.37
    m = list(law.initial_memory(s))
    for _ in range(3):  # away from rest, the last argument being s
        m = advance(s, m, q, 0.02).full().ravel()
    h = 1e-7
    moved = (advance(s, m, q, h).full().ravel() - m)[own] / h
    assert rates(s, m, q).full().ravel() == pytest.approx(moved, rel=1e-4, abs=1e-6)
    assert float(value(s, m, q, 0.0)) == pytest.approx(float(value(s, m, q, 1e-12)), rel=1e-9)


def test_a_program_has_one_time_since_its_memory() -> None:
    held = program(block(DahlFriction(), GrowingDamping()))
    assert flowing(held) is held
    free = flowing(program(block(DahlFriction())))
    assert set(free.states) == {"p_m", "q_k", "mu_m0"}


# -- what it cannot do ---
def switched() -> BondGraph:
    with BondGraph("g") as g:
        gate = X1("gate")
        Se("V") >> gate >> R("R_1", 1.0)
        gate >> C("C_1", 1.0)
        gate >> Df("i")
    return g


@pytest.mark.parametrize(
    ("make", "source", "says"),
    [
        (lambda: block(Coulomb(0.3)), "F", "mu has a law that jumps.*use LuGre or DahlFriction"),
        (switched, "V", "gate can switch.*use simulate_modes"),
        (MODELS["stack_ang"], "V_in", "no states, so idas has nothing to integrate"),
        (lambda: compile_model(block()), "F", "idas needs the graph"),
    ],
)
def test_refusals_are_one_line(make: Any, source: str, says: str) -> None:
    t, force = push(20)
    with pytest.raises(UnusableInput, match=says) as caught:
        simulate(make(), t, {source: force}, integrator="idas")
    assert "\n" not in str(caught.value)


def test_unknown_integrators_have_neighbours() -> None:
    t, force = push(20)
    with pytest.raises(UnknownName, match=r"no integrator 'ida' .*'idas'.* Known: cvodes, idas"):
        simulate(block(), t, {"F": force}, integrator="ida")


def test_failure_is_one_line_and_nothing_else(capfd: Any) -> None:
    """The rate of a step of zero is no number, which IDAS asks for."""
    t, force = push()
    graph = block(spring=GrowingDamping(0.0, 3.0, 0.01, 3.0))
    with pytest.raises(
        BondsightError, match=r"block: idas gave up after 0\.\d+ s \(IDA_"
    ) as caught:
        simulate(graph, t, {"F": force}, integrator="idas")
    assert re.search("sample faster, .*take the other integrator", str(caught.value))
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_ctrl_c_is_heard(monkeypatch: Any) -> None:
    t, force = push()
    onward = Stepper.onward

    def pressed(self: Stepper, *arguments: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        return onward(self, *arguments)

    monkeypatch.setattr(Stepper, "onward", pressed)
    with pytest.raises(KeyboardInterrupt):
        simulate(block(), t, {"F": force}, integrator="cvodes")
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
