"""Dry friction beside products of signals: the general step sticks, slides and turns as it must."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
import sympy as sp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se, Sf, Zero
from bondgraph.energy.bond_power import observables
from bondgraph.energy.ledger import ledger
from bondgraph.equations.derivation import equations
from bondgraph.graph.composing.hierarchy import use
from bondgraph.graph.composing.modulated_components import MODULATED
from bondgraph.graph.elements import MTF, CField
from bondgraph.graph.modulation import external
from bondgraph.laws import AsymmetricCoulomb, Coulomb, Law, Stribeck
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import compile_model
from bondgraph.simulation.radau.jumping import stepping_program
from bondgraph.simulation.radau.native import GeneralRun, prepare_general, run_general
from bondgraph.simulation.simulate import simulate
from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.native import compiler

Floats = NDArray[np.float64]
M, K, D, YIELD, SHARE = 1.0, 200.0, 2.0, 1.0, 2.0
STEP = 1e-3


def seat(stiffness: float = K) -> BondGraph:
    """A mass on a spring and a magnetorheological damper, whose yield an input commands."""
    part = MODULATED.make("magnetorheological_damper", damping=D, force=YIELD, sensitivity=SHARE)
    with BondGraph("seat") as g:
        damper, body = use(part, "d"), One("body")
        Se("F", unit="N") >> body >> I("m", M, unit="kg")
        body >> C("k", stiffness=stiffness, unit="N/m")
        body >> damper.left
        damper.right >> Sf("road", unit="m/s")
        body >> Dq("x", unit="m")
        body >> Df("v", unit="m/s")
    return g


def coupled(law: Law, more: Law | None = None) -> BondGraph:
    """Two masses that rub on the ground and on each other: at rest two contacts hold the third."""
    with BondGraph("coupled") as g:
        a = g.parameter("a", SHARE)
        first, second, between, slip = One("first"), One("second"), Zero("between"), One("slip")
        Se("F", unit="N") >> first >> I("m1", M, unit="kg")
        first >> between >> second >> I("m2", 0.5, unit="kg")
        between >> slip >> C("k", stiffness=400.0, unit="N/m")
        slip >> R("rub", sp.S.Zero, law=Coulomb(0.7))
        second >> R("drag", 0.3, unit="N*s/m", law=Coulomb(0.4))
        first >> MTF("valve", ratio=1 + a * external("current")) >> R("plate", sp.S.Zero, law=law)
        if more is not None:
            first >> R("more", sp.S.Zero, law=more)
        first >> Df("v1", unit="m/s")
        second >> Df("v2", unit="m/s")
    return g


def swung(n: int = 3000) -> dict[str, Floats]:
    t = STEP * np.arange(n)
    return {
        "F": 4.0 * np.sin(2 * np.pi * 1.1 * t) + 1.5 * np.sin(2 * np.pi * 0.37 * t),
        "in_current": 0.5 - 0.5 * np.cos(2 * np.pi * 0.8 * t),
    }


def commands_of(graph: BondGraph, n: int = 3000) -> dict[str, Floats]:
    """Commands by the names of a graph."""
    made = swung(n)
    if graph.name == "seat":
        return {"F": made["F"], "in_d_current": made["in_current"], "road": np.zeros(n)}
    return made


def by_events(time: Any, force: Floats, level: Floats) -> Floats:
    """Displacement and velocity of the seat, shape (2, N), from one event to the next."""

    def at(values: Floats) -> Callable[[float], float]:
        return lambda t: float(np.interp(t, time, values))

    pull, hold = at(force), at(level)

    def sliding(way: float) -> Any:
        def rate(t: float, y: Floats) -> list[float]:
            return [y[1], (pull(t) - K * y[0] - D * y[1] - way * hold(t)) / M]

        return rate

    def stops(t: float, y: Floats) -> float:
        return float(y[1]) if t > begin + 1e-9 else way

    def yields(t: float, y: Floats) -> float:
        return float(abs(pull(t) - K * y[0]) - hold(t))

    stops.terminal = yields.terminal = True  # type: ignore[attr-defined]
    yields.direction = 1.0  # type: ignore[attr-defined]
    found, begin, y, way = np.zeros((2, time.size)), 0.0, np.zeros(2), 0.0
    while begin < time[-1]:
        law, event = (sliding(way), stops) if way else (lambda t, y: [0.0, 0.0], yields)
        made = solve_ivp(
            law, (begin, time[-1]), y, "DOP853", events=event, dense_output=True,
            rtol=1e-10, atol=1e-13, max_step=STEP,
        )  # fmt: skip
        inside = (time >= begin) & (time <= made.t[-1])
        found[:, inside] = made.sol(time[inside])
        begin, y = float(made.t[-1]), np.array([made.y[0, -1], 0.0])
        loose = pull(begin) - K * y[0]
        stuck = way and abs(loose) <= hold(begin)
        way = 0.0 if stuck else float(np.sign(loose))
    return found


def run_of(graph: BondGraph, u: Floats, n_sub: int = 1, hold: str = "linear") -> GeneralRun:
    made = stepping_program(equations(graph))
    ready = prepare_general(made, np.array(made.nominal), STEP, n_sub)
    return run_general(ready, u, np.zeros(len(made.states)), hold)


def inputs_of(graph: BondGraph, n: int) -> Floats:
    given = commands_of(graph, n)
    return np.stack([given[i] for i in stepping_program(equations(graph)).inputs], axis=1)


def test_a_commanded_yield_on_a_mass_follows_its_events() -> None:
    """Stick, slip and reversals of an integrator that looks for each of them."""
    graph, n = seat(), 3000
    time, given = STEP * np.arange(n), commands_of(graph, n)
    run = simulate(graph, time, given, hold="linear", accuracy=2e-5)
    x, v = by_events(time, given["F"], YIELD * (1 + SHARE * given["in_d_current"]))
    assert np.abs(run["x"] - x).max() < 1e-4 * np.ptp(x)
    assert np.abs(run["v"] - v).max() < 5e-4 * np.ptp(v)
    resting = (np.abs(v) == 0.0).sum()
    assert 200 < resting < n - 200  # both are met
    assert (run["v"] == 0.0).sum() == pytest.approx(resting, abs=10)


def test_it_holds_below_its_yield_and_lets_go_above() -> None:
    """No creep in 3e5 steps of a force that swings below the level; the rest force is its own."""
    graph, n = seat(1e-9), 30001
    time = STEP * np.arange(n)
    force = 1.9 * np.sin(2 * np.pi * 3.0 * time)
    given = {"F": force, "in_d_current": np.full(n, 0.5), "road": np.zeros(n)}  # level 2 N
    run = simulate(graph, time, given, hold="linear", x0=np.zeros(2), observed=("e_d_yield",))
    assert not run["v"].any()
    assert not run["x"].any()
    np.testing.assert_allclose(2.0 * run["e_d_yield"][1:], force[1:], atol=1e-9)
    given["in_d_current"] = np.full(n, 0.4)  # level 1.8 N
    assert np.abs(simulate(graph, time, given, hold="linear", x0=np.zeros(2))["v"]).max() > 1e-4


def plain() -> BondGraph:
    """The same contact without a command, which the exact step takes."""
    with BondGraph("plain") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", M, unit="kg")
        body >> C("k", stiffness=K, unit="N/m")
        body >> R("c", D, unit="N*s/m", law=Coulomb(YIELD))
        body >> Df("v", unit="m/s")
    return g


def test_it_is_what_the_exact_step_makes_of_the_same_contact() -> None:
    """Both lose an order where a contact sticks or turns: one over the step, at least."""
    graph, u = plain(), swung()["F"][:, None]
    exact = compile_model(graph)
    start = np.zeros(exact.n_x)
    fine = run_record(exact, exact.nominal(), u, STEP, start, n_sub=512, hold="linear").y
    steps = [1, 2, 4, 8, 16, 32]
    errors = [np.sqrt(np.mean((run_of(graph, u, k).y - fine) ** 2)) for k in steps]
    assert errors[-1] < 2e-5 * np.ptp(fine)
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] < -0.8


def test_while_it_slides_the_order_is_that_of_the_step() -> None:
    """Third order under a level that a command changes smoothly."""
    graph, n = seat(), 41
    slow = 20.0 * STEP * np.arange(n)
    u = np.zeros((n, 3))
    names = stepping_program(equations(graph)).inputs
    u[:, names.index("F")], u[:, names.index("in_d_current")] = 20.0, 0.5 * np.sin(slow)
    made = stepping_program(equations(graph))

    def ended(n_sub: int) -> Floats:
        ready = prepare_general(made, np.array(made.nominal), STEP, n_sub)
        start = np.array([2.0, 0.0])[[made.states.index(s) for s in ("p_m", "q_k")]]
        return run_general(ready, u, start, "linear").x

    fine = ended(64)
    errors = [np.abs(ended(k) - fine).max() for k in (1, 2, 4)]
    assert np.polyfit(np.log([1, 2, 4]), np.log(errors), 1)[0] == pytest.approx(-3.0, abs=0.25)


@pytest.mark.parametrize(
    ("law", "more"),
    [
        (Coulomb(1.0), None),
        (Stribeck(1.0, 0.5, 0.05), None),
        (AsymmetricCoulomb(), None),
        (Coulomb(1.0), Coulomb(0.3)),
    ],
)
def test_contacts_that_hold_the_same_motion_share_its_force(law: Law, more: Law | None) -> None:
    graph, n = coupled(law, more), 2000
    run = simulate(
        graph, STEP * np.arange(n), swung(n), hold="linear", observed=observables(graph)
    )  # fmt: skip
    assert 50 < (run["v1"] == 0.0).sum() < n - 50
    book = ledger(graph, run)
    assert book.closes
    assert all(e.lost[-1] >= 0 for e in book.entries if e.kind == "R")


def test_the_energy_of_the_seat_is_kept() -> None:
    graph, n = seat(), 3000
    run = simulate(
        graph, STEP * np.arange(n), commands_of(graph, n), hold="linear",
        observed=observables(graph),
    )  # fmt: skip
    assert ledger(graph, run).closes
    s, w = run.laws["d_yield"]
    assert (s * w).min() > -1e-15
    assert np.abs(w).max() == pytest.approx(YIELD)


@pytest.mark.parametrize("graph", [seat(), coupled(Coulomb(1.0))])
def test_tangents_are_those_of_differences(graph: BondGraph) -> None:
    made, n = stepping_program(equations(graph)), 900
    u, p = inputs_of(graph, n), np.array(made.nominal)
    start = 0.1 * np.arange(1, len(made.states) + 1) / 10

    def run(values: Floats, x0: Floats) -> Floats:
        return run_general(prepare_general(made, values, STEP, 2), u, x0, "linear").y

    ready = prepare_general(made, p, STEP, 2, range(p.size), True)
    found = run_general(ready, u, start, "linear")
    for i in range(p.size + start.size):
        moved, at = (p.copy(), i) if i < p.size else (start.copy(), i - p.size)
        size = 1e-7 * max(abs(float(moved[at])), 1e-3)
        ends = []
        for way in (1.0, -1.0):
            other = moved.copy()
            other[at] += way * size
            ends.append(run(other, start) if i < p.size else run(p, other))
        told = (ends[0] - ends[1]) / (2 * size)
        scale = np.abs(told).max(axis=0) + 1e-9
        assert np.abs((found.dy[:, :, i] - told) / scale).max() < 1e-4


@pytest.mark.skipif(compiler() is None, reason="no gcc")
@pytest.mark.parametrize("graph", [seat(), coupled(Coulomb(1.0), Coulomb(0.3))])
def test_both_machines_agree(graph: BondGraph, monkeypatch: pytest.MonkeyPatch) -> None:
    made, n = stepping_program(equations(graph)), 700
    ready = prepare_general(made, np.array(made.nominal), STEP, 2, (0, 1), True)
    u, start = inputs_of(graph, n), np.zeros(len(made.states))
    native = run_general(ready, u, start, "linear")
    monkeypatch.setenv("BONDSIGHT_NO_COMPILER", "1")
    machine = run_general(ready, u, start, "linear")
    assert machine.settled
    np.testing.assert_allclose(machine.y, native.y, atol=1e-12)
    scale = np.abs(native.dy).max(axis=0) + 1e-9
    assert np.abs((machine.dy - native.dy) / scale).max() < 1e-6


def test_a_pendulum_rubs_in_its_bearing() -> None:
    """Against LSODA with a steep friction instead of a jump; it comes to rest off the low."""
    angle = sp.Symbol("q1", real=True)
    with BondGraph("pendulum") as g:
        weight, shaft = g.parameter("mgl", 3.0, "N*m"), One("shaft")
        Se("T", unit="N*m") >> shaft >> I("J", 0.05, unit="kg*m^2")
        shaft >> R("b", 0.02, unit="N*m*s/rad", law=Coulomb(0.15, "N*m"))
        shaft >> CField("gravity", energy=weight * (1 - sp.cos(angle)), ports=1)
        shaft >> Dq("phi", unit="rad")
    time = 2e-3 * np.arange(2500)
    start = {"p_J": 0.0, "q_gravity1": 1.4}
    run = simulate(g, time, {"T": 0.0 * time}, x0=start, hold="linear")

    def rate(_: float, y: Floats) -> list[float]:
        rub = 0.02 * y[1] + 0.15 * np.tanh(y[1] / 1e-5)
        return [y[1], (-3.0 * np.sin(y[0]) - rub) / 0.05]

    slow = solve_ivp(rate, (0.0, time[-1]), [1.4, 0.0], "LSODA", time, rtol=1e-9, atol=1e-12)
    moving = time < 3.0  # what is only steep creeps on
    assert np.abs(run["phi"] - slow.y[0])[moving].max() < 2e-3
    assert np.ptp(run["phi"][-500:]) < 1e-12
    assert abs(3.0 * np.sin(run["phi"][-1])) < 0.15


def test_a_jump_without_a_formula_is_still_refused() -> None:
    """Only a law that is closed over the step by a formula can be held."""

    @dataclass(frozen=True)
    class Relay(Coulomb):
        name: ClassVar[str] = "relay"
        closed: ClassVar[bool] = False

    made = stepping_program(equations(coupled(Relay(1.0))))
    assert [made.laws[i].element for i in made.held] == ["rub", "drag"]
    with pytest.raises(UnusableInput, match="coupled: plate has a law that jumps"):
        prepare_general(made, np.array(made.nominal), STEP)


def test_what_cannot_settle_says_so() -> None:
    """A mass under a wild force, asked for more than steps across jumps can give."""
    graph, n = seat(1.0), 60
    given = commands_of(graph, n)
    given["F"] = 1e6 * np.random.default_rng(3).standard_normal(n)
    with pytest.raises(BondsightError, match="the outputs do not settle within 256 sub-steps"):
        simulate(graph, 10.0 * np.arange(n), given, hold="linear", accuracy=1e-12)
