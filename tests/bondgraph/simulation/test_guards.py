"""Guards: several at once, near misses, what they cost, and which are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from bondgraph import (
    BondGraph,
    C,
    De,
    Df,
    Dq,
    GraphError,
    I,
    MSf,
    One,
    R,
    Se,
    Sf,
    Zero,
    displacement,
    effort,
    flow,
    simulate,
)
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import X0, X1
from bondgraph.graph.parameter import Parameter
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Hysteretic, Polynomial
from bondgraph.simulation.modes.guards import Guard, SwitchEvent, When
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.simulation.modes.run import simulate_modes
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.errors import UnknownName, UnusableInput
from tests.bondgraph.simulation.hybrid import Location, simulated
from tests.bondgraph.simulation.switched import (
    THERMOSTAT,
    assert_same_events,
    blocks_or_conducts,
    diode,
    diode_circuit,
    oven,
    rectifier,
    told,
)
from tests.counted import calls


def two_valves() -> BondGraph:
    """A filling tank with two drains."""
    with BondGraph("tank") as g:
        tank, a, b = Zero("tank"), X1("a", on=False), X1("b", on=False)
        MSf("pump", 1.0) >> tank >> C("volume", 1.0)
        tank >> a >> R("R_a", 10.0)
        tank >> b >> R("R_b", 10.0)
        tank >> De("p")
    return g


def test_two_guards_in_one_interval_act_in_order() -> None:
    t = np.linspace(0.0, 4.0, 5)
    guards = [Guard("a", on=When("p", above=1.75)), Guard("b", on=When("p", above=1.25))]
    run = simulate_modes(two_valves(), t, (), events=guards, start={"q_volume": 0.0})
    later = 10.0 * np.log(8.75 / 8.25)  # towards 10
    expected = (SwitchEvent(1.25, "b", True), SwitchEvent(1.25 + later, "a", True))
    assert [e.junction for e in run.events] == [e.junction for e in expected]
    assert [e.time for e in run.events] == pytest.approx([e.time for e in expected], abs=1e-12)


def test_two_guards_at_one_time_act_together() -> None:
    t = np.linspace(0.0, 4.0, 41)
    guards = [Guard(n, on=When("p", above=1.25)) for n in "ab"]
    run = simulate_modes(two_valves(), t, (), events=guards, start={"q_volume": 0.0})
    assert [e.junction for e in run.events] == ["a", "b"]
    assert run.events[0].time == run.events[1].time == pytest.approx(1.25, abs=1e-12)


def test_one_switch_may_ask_for_the_next() -> None:
    """The second drain opens by the flow through the first, which begins at the switch."""
    t = np.linspace(0.0, 4.0, 41)
    guards = [Guard("a", on=When("p", above=1.25)), Guard("b", on=When(flow("a"), above=0.1))]
    run = simulate_modes(two_valves(), t, (), events=guards, start={"q_volume": 0.0})
    assert [e.junction for e in run.events] == ["a", "b"]
    assert run.events[0].time == run.events[1].time


def swing(**law: Any) -> BondGraph:
    """An oscillator with a brake that begins to act."""
    with BondGraph("swing") as g:
        body, brake = One("body"), X0("brake", on=False)
        body >> I("m", 1.0)
        body >> C("k", stiffness=1.0, **law)
        body >> brake >> R("b", 0.5)
        body >> Df("v")
    return g


@pytest.mark.parametrize(("level", "count"), [(1.0 - 1e-4, 1), (1.0 + 1e-4, 0)])
@pytest.mark.parametrize("shift", [0.0, 0.13, 0.37])
def test_a_level_that_is_grazed_between_samples_is_seen(
    level: float, count: int, shift: float
) -> None:
    t = np.arange(12) * 0.4 + shift
    start = {"q_k": float(np.sin(shift)), "p_m": float(np.cos(shift))}
    guard = Guard("brake", on=When(displacement("k"), above=level))
    run = simulate_modes(swing(), t, (), events=[guard], start=start)
    assert len(run.events) == count
    if count:
        assert run.events[0].time == pytest.approx(np.arcsin(level), abs=1e-9)


def test_a_level_beyond_either_side() -> None:
    t = np.arange(100) * 0.1
    loose = Guard("brake", on=When(displacement("k"), above=2.0, below=-0.5))
    run = simulate_modes(swing(), t, (), events=[loose], start={"q_k": 0.0, "p_m": 1.0})
    assert_same_events(told(run), [(np.pi + np.arcsin(0.5), "on")], 1e-11)


def test_a_guard_that_holds_at_the_start_acts_there() -> None:
    t = np.linspace(0.0, 1.0, 11)
    guard = Guard("brake", on=When(displacement("k"), above=0.5))
    start = {"q_k": 1.0, "p_m": 0.5}
    run = simulate_modes(swing(), t, (), events=[guard], start=start)
    plain = simulate_modes(swing(), t, [(0.0, {"brake": True})], start=start)
    assert run.events == (SwitchEvent(0.0, "brake", True),)
    np.testing.assert_allclose(run["v"], plain["v"], atol=1e-12)


def test_an_input_that_jumps_switches_at_the_jump() -> None:
    t = np.linspace(0.0, 1.0, 11)
    v = np.where(t < 0.45, -1.0, 1.0)
    run = simulate_modes(rectifier(), t, (), {"V": v}, events=[diode("D")], hold="hold")
    assert [e.junction for e in run.events] == ["D"]
    assert run.events[0].time == pytest.approx(0.5, abs=1e-12)
    short = np.where(np.abs(t - 0.5) < 0.05, 1.0, -1.0)
    run = simulate_modes(rectifier(), t, (), {"V": short}, events=[diode("D")], hold="hold")
    # after 0.1 s at 1 V the source is turned round
    assert [e.time for e in run.events] == pytest.approx([0.5, 0.6], abs=1e-12)


def test_laws_that_bend_bring_the_time_with_their_accuracy() -> None:
    g = swing(law=Polynomial(orders=(3,)))
    cubic = next(n for n in g.parameters if n not in ("m", "k", "b"))
    guard = Guard("brake", on=When(displacement("k"), above=0.4))
    t = np.linspace(0.0, 4.0, 81)
    modes = {
        "off": Location(
            lambda s, x: [-x[1] - 3 * x[1] ** 3, x[0]], {"on": lambda s, x: x[1] - 0.4}
        ),
        "on": Location(lambda s, x: [-x[1] - 3 * x[1] ** 3 - 0.5 * x[0], x[0]]),
    }
    truth, begun = simulated(modes, "off", [1.2, 0.0], t)
    late = []
    for accuracy in (1e-3, 1e-5, 1e-7):
        run = simulate_modes(
            g, t, (), None, {cubic: 3.0}, start={"p_m": 1.2, "q_k": 0.0}, events=[guard],
            accuracy=accuracy,
        )  # fmt: skip
        late.append(abs(run.events[0].time - begun[0][0]))
    assert late[1] < 1e-4
    assert late[2] < min(late[0], 1e-6)
    np.testing.assert_allclose(run["v"], truth[:, 0], rtol=0, atol=1e-6)


# -- engine -----------------------------------------------------------------------------------
def test_two_switches_that_alternate() -> None:
    """A source of either sign feeds two capacitors, one through each diode."""
    with BondGraph("doubler") as g:
        feed, plus, minus = Zero("feed"), X1("P", on=False), X1("M", on=False)
        inlet = One("inlet")
        Se("V", unit="V") >> inlet >> R("R_s", 1.0, unit="ohm")
        inlet >> feed
        feed >> R("bleed", 1e4, unit="ohm")
        a, b = Zero("a"), Zero("b")
        feed >> plus >> a >> C("C_a", 1e-2, unit="F")
        b >> minus >> feed
        b >> C("C_b", 1e-2, unit="F")
        a >> R("R_a", 50.0, unit="ohm")
        b >> R("R_b", 80.0, unit="ohm")
        a >> De("u_a", unit="V")
        b >> De("u_b", unit="V")
    t = np.linspace(0.0, 1.0, 501)
    v = np.sin(2 * np.pi * 5 * t)
    w = 1.0 / (1.0 + 1e-4)  # of the node: source over the bleeder

    def node(s: float) -> float:
        return float(np.interp(s, t, v)) * w

    def rates(high: bool, low: bool) -> Any:
        def change(s: float, x: Any) -> Any:
            i = (node(s) - x[0]) / w * high
            j = (node(s) - x[1]) / w * low
            return [(i - x[0] / 50.0) / 1e-2, (j - x[1] / 80.0) / 1e-2]

        return change

    modes = {
        "": Location(rates(False, False), {
            "P": lambda s, x: node(s) - x[0], "M": lambda s, x: x[1] - node(s)}),
        "P": Location(rates(True, False), {"": lambda s, x: x[0] - node(s)}),
        "M": Location(rates(False, True), {"": lambda s, x: node(s) - x[1]}),
    }  # fmt: skip
    truth, begun = simulated(modes, "", [0.0, 0.0], t)
    guards = [diode("P"), diode("M")]
    run = simulate_modes(g, t, (), {"V": v}, events=guards, hold="linear")
    np.testing.assert_allclose(run["u_a"], truth[:, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(run["u_b"], truth[:, 1], rtol=0, atol=1e-9)
    assert len(begun) > 15
    assert [e.time for e in run.events] == pytest.approx([at for at, _ in begun], abs=1e-10)


@pytest.mark.parametrize("hold", ["hold", "linear"])
def test_events_given_as_a_schedule_make_the_same_run(hold: str) -> None:
    """Memory, a bent store and a drifting sensor go on through both in the same way."""
    law = Hysteretic(PrandtlIshlinskii((0.0, 0.1, 0.2), (1.0, 0.3, 0.4)))
    with BondGraph("g") as g:
        body, brake = One("body"), X0("brake", on=False)
        Se("F", drive=Drive(law=law)) >> body >> I("m", 1.0)
        body >> R("b", 0.5)
        body >> C("k", stiffness=4.0)
        body >> brake >> R("pad", 2.0)
        body >> Dq("x", drift=("slow",))
        body >> Df("v")
    g = g.with_parameters([Parameter("slow", 0.02, "1", positive=False)])
    t = np.linspace(0.0, 10.0, 501)
    force = {"F": np.sin(2 * t) + 0.3 * np.sin(7 * t)}
    guard = Guard("brake", on=When(flow("body"), above=0.2), off=When(flow("body"), below=0.1))
    run = simulate_modes(g, t, (), force, events=[guard], hold=hold, accuracy=1e-7)
    assert len(run.events) > 4
    plan = [(e.time, {e.junction: e.on}) for e in run.events]
    again = simulate_modes(g, t, plan, force, hold=hold, accuracy=1e-7)
    np.testing.assert_allclose(run["x"], again["x"], atol=1e-6)
    np.testing.assert_allclose(run["v"], again["v"], atol=1e-6)
    assert again.events == ()


@pytest.mark.parametrize("events", [(), (Guard("heater", on=When("T", above=50.0)),)])
def test_a_guard_that_never_acts_costs_no_loop_over_samples(events: tuple[Guard, ...]) -> None:
    def spent(count: int) -> int:
        t = np.linspace(0.0, 10.0, count)
        v = {"T_h": np.sin(3 * t)}
        plain = simulate(in_mode(oven(), {"heater": False}), t, v)
        made: list[Trajectory] = []
        work = calls(lambda: made.append(simulate_modes(oven(), t, (), v, events=events)))
        np.testing.assert_allclose(made[-1]["T"], plain["T"], atol=1e-12)
        return work

    spent(2_001)  # what is compiled and cached
    assert spent(64_001) < 3 * spent(2_001)


# -- what cannot be ---------------------------------------------------------------------------
def test_a_guard_that_chatters_says_so() -> None:
    t = np.linspace(0.0, 3.0, 31)
    bare = Guard("heater", on=When("T", below=20.0), off=When("T", above=20.0))
    with pytest.raises(GraphError, match=r"oven: heater switches more than 100 times between") as e:
        simulate_modes(oven(), t, (), {"T_h": 0 * t + 60.0}, events=[bare])
    assert "off level apart from its on level" in str(e.value)


def test_guards_that_contradict_each_other_say_so() -> None:
    """The valve closes by the flow that it lets through, and opens by what it then holds."""
    t = np.linspace(0.0, 3.0, 31)
    never = Guard("a", on=When("p", above=1.25), off=When(flow("a"), above=0.1))
    with pytest.raises(GraphError, match=r"at 1.25 s the guards contradict each other: .* of a "):
        simulate_modes(two_valves(), t, (), events=[never], start={"q_volume": 0.0})


def test_a_coil_that_no_diode_catches_is_refused_as_before() -> None:
    with BondGraph("coil") as g:
        switch = X1("switch")
        Se("V") >> switch >> R("R_1", 1.0)
        switch >> I("L", 1.0)
        switch >> Df("i")
    t = np.linspace(0.0, 1.0, 11)
    cut = Guard("switch", off=When(flow("switch"), above=0.3))
    with pytest.raises(GraphError, match=r"needs an impulse: the store L .* no other state of its"):
        simulate_modes(g, t, (), {"V": 0 * t + 1.0}, events=[cut])


@pytest.mark.parametrize(
    ("guard", "line"),
    [
        (Guard("heatr", on=When("T", below=1.0)), "Did you mean 'heater'"),
        (Guard("heater", on=When("TT", below=1.0)), "no sensor 'TT' in oven for the guard of heat"),
        (Guard("heater", on=When(effort("rom"), below=1.0)), "Did you mean 'room'"),
        (Guard("heater", on=When(displacement("Cr"), below=1.0)), "Did you mean 'C_r'"),
        (
            Guard("heater", on=When("T", below="lo")),
            "no parameter 'lo' in oven: level of the guard",
        ),
        (
            Guard("heater", on=When("T", below=21.0), off=When("T", above=19.0)),
            "can hold at once; the wrong way round",
        ),
        (
            Guard("heater", on=When("T", below=19.0), off=When("T", below=10.0)),
            "can hold at once",
        ),
        (Guard("heater", on=When("T", above=1.0, below=2.0)), "always holds"),
    ],
)
def test_guards_that_make_no_sense_are_refused(guard: Guard, line: str) -> None:
    t = np.linspace(0.0, 1.0, 11)
    with pytest.raises((UnknownName, UnusableInput), match=line):
        simulate_modes(oven(), t, (), {"T_h": 0 * t}, events=[guard])


def test_values_that_are_no_guards_are_refused() -> None:
    t, drive = np.linspace(0.0, 1.0, 11), {"T_h": np.zeros(11)}
    with pytest.raises(UnusableInput, match="above = nan is not a finite number"):
        When("T", above=float("nan"))
    with pytest.raises(UnusableInput, match="give a level"):
        When("T")
    with pytest.raises(UnusableInput, match="give the name of a sensor"):
        When(3.0, above=1.0)
    with pytest.raises(GraphError, match="give on="):
        Guard("heater")
    with pytest.raises(GraphError, match="give a When"):
        Guard("heater", on=effort("room"))
    with pytest.raises(GraphError, match="give the name of a switched junction"):
        Guard(X1("heater"), on=When("T", above=1.0))  # type: ignore[arg-type]
    with pytest.raises(GraphError, match=r"give Guard\(...\)s"):
        simulate_modes(oven(), t, (), drive, events=["heater"])  # type: ignore[list-item]
    with pytest.raises(GraphError, match="heater has two guards"):
        simulate_modes(oven(), t, (), drive, events=[THERMOSTAT, THERMOSTAT])
    with pytest.raises(GraphError, match="by the schedule and by a guard"):
        simulate_modes(oven(), t, [(0.5, {"heater": True})], drive, events=[THERMOSTAT])


def test_a_late_sensor_is_not_watched_but_what_it_reads_is() -> None:
    with BondGraph("late") as g:
        heater, room = X1("heater", on=False), Zero("room")
        Se("T_h", drive=Drive(delay="lag")) >> heater >> R("R_h", 1.0)
        heater >> room >> C("C_r", 1.0)
        room >> R("loss", 1.0)
        room >> De("T", delay="lag")
    g = g.with_parameters([Parameter("lag", 0.1, "s")])
    t = np.linspace(0.0, 1.0, 101)
    drive = {"T_h": 0 * t + 60.0}
    with pytest.raises(UnusableInput, match="T is late"):
        simulate_modes(g, t, (), drive, events=[THERMOSTAT])
    plain = Guard("heater", on=When(effort("room"), below=19), off=When(effort("room"), above=21))
    run = simulate_modes(g, t, (), drive, events=[plain])
    assert run.events[1].time == pytest.approx(0.1 + 0.5 * np.log(30.0 / 9.0), abs=1e-9)


@pytest.mark.parametrize("tail", [0.0, -1e-3])
def test_a_current_that_begins_at_zero_ends_where_it_crosses_it(tail: float) -> None:
    """The signal is at its level where the piece begins, and again before the next sample."""
    with BondGraph("coil") as g:
        d = X1("D", on=True)
        Se("V", unit="V") >> d >> R("R_s", 1.0, unit="ohm")
        d >> I("L", 1.0, unit="H")
        d >> Df("i", unit="A")
    t = np.array([0.0, 1.0, 2.0])
    v = np.array([0.1, -1.0, tail])
    run = simulate_modes(g, t, (), {"V": v}, events=[diode("D")], hold="linear")
    # L i' + R i = 0.1 - 1.1 t from rest
    root = brentq(lambda s: 1.2 * (1 - np.exp(-s)) - 1.1 * s, 0.05, 1.0, xtol=1e-15)
    assert_same_events(told(run), [(root, "off")], 1e-12)


# -- any circuit ------------------------------------------------------------------------------
value = st.floats(0.1, 10.0)


@settings(max_examples=10, deadline=None)
@given(value, value, value, value, st.booleans(), st.integers(0, 2**31), st.booleans())
@example(1.0, 1.0, 1.0, 1.0, True, 100000, False)
def test_a_diode_blocks_or_conducts_in_any_circuit(
    source: float, load: float, store: float, turn: float, coil: bool, seed: int, held: bool
) -> None:
    g = diode_circuit(source, load, store, coil=coil)
    blocks_or_conducts(g, turn, seed, held=held)


def test_a_level_is_reached_where_the_search_looks_to_within_rounding() -> None:
    """Runs in one step and in many to the very same time differ in their last bits."""
    with BondGraph("tank") as g:
        tank, valve = Zero("tank"), X1("valve", on=False)
        Sf("q") >> tank >> C("c", 1.0)
        tank >> De("h")
        tank >> valve >> R("r", 1.0)
    t = np.arange(5) * 0.01
    for part in range(1, 64, 3):
        at = (3 + part / 64) * 0.01
        valve_opens = Guard("valve", on=When("h", above=2.64 * at))
        run = simulate_modes(g, t, (), {"q": np.full(5, 2.64)}, events=[valve_opens])
        assert_same_events(told(run), [(at, "on")], 1e-12)
