"""Switched junctions: one graph a mode, piecewise simulation, impulses refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, Df, Dq, GraphError, I, One, R, Se, Zero, simulate
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import X0, X1, MSe, MSf
from bondgraph.graph.parameter import Parameter
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Hysteretic, Polynomial, SlewLimit
from bondgraph.simulation.lure import compile_model
from bondgraph.simulation.modes.resolve import in_mode, mode_of, modes
from bondgraph.simulation.modes.run import simulate_modes
from bondgraph.support.errors import UnknownName, UnusableInput

TIME = np.linspace(0.0, 5.0, 501)
STEP = {"V": np.ones(TIME.size)}


def charger() -> BondGraph:
    """A source that charges a capacitor through a resistor and a switch; a leak discharges it."""
    with BondGraph("charger") as g:
        switch, node = X1("switch"), Zero("node")
        Se("V", unit="V") >> switch >> R("R_1", 0.5, unit="ohm")
        switch >> node >> C("C_1", 1.0, unit="F")
        node >> R("leak", 2.0, unit="ohm")
    return g


def two_capacitors() -> BondGraph:
    """Two capacitors, the second behind a switch."""
    with BondGraph("pair") as g:
        loop, first = One("loop"), Zero("first")
        switch, second = X1("switch", on=False), Zero("second")
        Se("V") >> loop >> R("R_1", 1.0)
        loop >> first >> C("C_1", 1.0)
        first >> switch >> second >> C("C_2", 2.0)
        second >> R("load", 3.0)
        first >> De("v")
    return g


def test_a_mode_is_a_graph_without_switches() -> None:
    g = charger()
    on, off = in_mode(g), in_mode(g, {"switch": False})
    assert type(on["switch"]) is One
    assert on.of_type(MSf) == ()
    assert [b.name for b in on.bonds] == [b.name for b in g.bonds]
    assert off.of_type(MSf) == (off["switch_off"],)
    assert off.bonds[-1].name == "switch_off>switch"
    assert off.check() == ()
    assert isinstance(g["switch"], X1)  # the original is untouched
    assert mode_of(g) == {"switch": True}


def test_an_effort_junction_that_is_off_has_zero_effort() -> None:
    with BondGraph("g") as g:
        loop, node = One("loop"), X0("node")
        Se("V") >> loop >> R("R_1", 2.0)
        loop >> node >> C("C_1", 1.0)
        node >> R("R_2", 1.0)
        loop >> Df("i")
    off = in_mode(g, {"node": False})
    assert isinstance(off["node"], Zero)
    assert [e.name for e in off.of_type(MSe)] == ["node_off"]
    run = simulate(off, TIME, {"V": np.sin(TIME)}, hold="linear")
    np.testing.assert_allclose(run["i"], np.sin(TIME) / 2.0, atol=1e-12)


def test_wrong_modes_are_refused() -> None:
    g = charger()
    with pytest.raises(UnknownName, match="Did you mean 'switch'"):
        in_mode(g, {"swich": False})
    with pytest.raises(GraphError, match="give True"):
        in_mode(g, {"switch": 0})  # type: ignore[dict-item]
    with BondGraph("taken") as taken:
        a = X1("a")
        Se("a_off") >> a >> R("R_1", 1.0)
    with pytest.raises(GraphError, match="'a_off' is the name of the zero source"):
        in_mode(taken, {"a": False})


def test_all_modes_are_listed_up_to_a_bound() -> None:
    with BondGraph("g") as g:
        a, b = X1("a"), X0("b", on=False)
        Se("V") >> a >> R("R_1", 1.0)
        a >> b >> C("C_1", 1.0)
        b >> R("R_2", 1.0)
    found = list(modes(g))
    assert [m for m, _ in found] == [
        {"a": True, "b": True},
        {"a": True, "b": False},
        {"a": False, "b": True},
        {"a": False, "b": False},
    ]
    assert len({tuple(h.elements) for _, h in found}) == 4
    with BondGraph("many") as many:
        last: X1 | Se = Se("V")
        for i in range(11):
            last = last >> X1(f"s{i}")
    with pytest.raises(GraphError, match=r"11 switched junctions have 2\^11 modes"):
        modes(many)


@pytest.mark.parametrize("switch_at", [2.0, 2.003, 1.9999999])
@pytest.mark.parametrize("hold", ["linear", "hold"])
def test_a_capacitor_charges_and_leaks_as_the_formula_says(switch_at: float, hold: str) -> None:
    with charger() as g:
        g["node"] >> De("u", unit="V")
    run = simulate_modes(g, TIME, [(switch_at, {"switch": False})], STEP, start={"q_C_1": 0.0},
                         hold=hold)  # fmt: skip
    rate, level = 1 / 0.5 + 1 / 2.0, 2.0 / 2.5
    charging = level * (1 - np.exp(-rate * TIME))
    peak = level * (1 - np.exp(-rate * switch_at))
    leaking = peak * np.exp(-(TIME - switch_at) / 2.0)
    expected = np.where(switch_at > TIME, charging, leaking)
    np.testing.assert_allclose(run["u"], expected, atol=1e-9)
    assert run.state == pytest.approx([leaking[-1]], rel=1e-9)


def test_on_and_off_again_is_the_plain_simulation_when_nothing_changes() -> None:
    with charger() as g:
        g["node"] >> De("u")
    drive = {"V": np.sin(3 * TIME)}
    plain = simulate(in_mode(g), TIME, drive)
    pieces = simulate_modes(g, TIME, [(1.234, {}), (2.5, {"switch": True})], drive)
    np.testing.assert_allclose(pieces["u"], plain["u"], atol=1e-10)


def test_a_switch_that_would_need_an_impulse_is_refused() -> None:
    g = two_capacitors()
    with pytest.raises(GraphError, match=r"switch on at 1 s needs an impulse: the store C_"):
        simulate_modes(g, TIME, [(1.0, {"switch": True})], STEP, start={"q_C_1": 0.0})


def test_a_switch_between_equal_voltages_is_allowed() -> None:
    g = two_capacitors()
    start = {"q_C_1": 0.5, "q_C_2": 1.0}
    # the source holds C_1 at 0.5 V and the load has just brought C_2 down to it
    high = 0.8
    meet = 6.0 * np.log(high / 0.5)
    start["q_C_2"] = 2.0 * high
    drive = {"V": np.full(TIME.size, 0.5)}
    run = simulate_modes(g, TIME, [(meet, {"switch": True})], drive, start=start)
    # together: (C_1 + C_2) dv/dt = (0.5 - v) / R_1 - v / load
    level, tau = 0.5 / (1 + 1 / 3.0), 3.0 / (1 + 1 / 3.0)
    after = level + (0.5 - level) * np.exp(-(TIME - meet) / tau)
    np.testing.assert_allclose(run["v"], np.where(meet > TIME, 0.5, after), atol=1e-8)
    # and apart again: nothing hinders that
    back = [(meet, {"switch": True}), (4.0, {"switch": False})]
    run = simulate_modes(g, TIME, back, drive, start=start)
    apart = 0.5 + (after[400] - 0.5) * np.exp(-(TIME - 4.0))
    np.testing.assert_allclose(run["v"][400:], apart[400:], atol=1e-8)


def test_an_open_coil_is_refused_with_a_current_and_taken_without() -> None:
    with BondGraph("coil") as g:
        switch = X1("switch")
        Se("V") >> switch >> R("R_1", 1.0)
        switch >> I("L", 1.0)
        switch >> Df("i")
    open_at = [(1.0, {"switch": False})]
    with pytest.raises(GraphError, match=r"impulse: the store L holds p_L = 0\.632"):
        simulate_modes(g, TIME, open_at, STEP, start={"p_L": 0.0})
    silent = {"V": np.where(TIME < 2.0, 0.0, 1.0)}
    run = simulate_modes(g, TIME, open_at, silent)
    np.testing.assert_allclose(run["i"], 0.0, atol=1e-12)


def clutch(damping: float | None) -> BondGraph:
    """Two inertias and a clutch between them, viscous or rigid; off it carries no force."""
    with BondGraph("clutch") as g:
        left, contact, right = One("left"), X0("contact", on=False), One("right")
        Se("F") >> left >> I("m_1", 1.0)
        left >> contact >> right >> I("m_2", 3.0)
        if damping:
            contact >> R("b", damping)
        left >> Df("v_1")
        right >> Df("v_2")
        right >> Dq("x_2")
    return g


def test_a_viscous_clutch_exchanges_momentum_only_while_it_is_on() -> None:
    switching = [(1.0, {"contact": True}), (3.0, {"contact": False})]
    start = {"p_m_2": 3.0}
    run = simulate_modes(clutch(0.5), TIME, switching, {"F": 0 * TIME}, start=start)
    together = np.clip(TIME - 1.0, 0.0, 2.0)
    slip = -np.exp(-0.5 * (1 + 1 / 3) * together)  # v_1 - v_2
    np.testing.assert_allclose(run["v_1"] - run["v_2"], slip, atol=1e-9)
    np.testing.assert_allclose(run["v_1"] + 3 * run["v_2"], 3.0, atol=1e-9)
    travelled = np.concatenate([[0], np.cumsum((run["v_2"][1:] + run["v_2"][:-1]) * 0.005)])
    np.testing.assert_allclose(run["x_2"], travelled, atol=2e-5)


def test_a_rigid_clutch_closes_only_at_equal_speeds() -> None:
    rest, close = {"F": 0 * TIME}, [(1.0, {"contact": True})]
    with pytest.raises(GraphError, match=r"the store m_\d holds p_m_\d = .* would have to jump"):
        simulate_modes(clutch(None), TIME, close, rest, start={"p_m_2": 3.0})
    # under a force of 1 N the first body reaches the speed of the second at 1 s
    run = simulate_modes(clutch(None), TIME, close, {"F": 0 * TIME + 1}, start={"p_m_2": 3.0})
    expected = np.where(TIME < 1.0, TIME, 1.0 + (TIME - 1.0) / 4)
    np.testing.assert_allclose(run["v_1"], expected, atol=1e-9)
    np.testing.assert_allclose(run["v_2"], np.maximum(expected, 1.0), atol=1e-9)


def test_positions_go_on_and_memory_is_kept() -> None:
    law = Hysteretic(PrandtlIshlinskii((0.0, 0.1, 0.2), (1.0, 0.3, 0.4)))
    with BondGraph("g") as g:
        body, drive = One("body"), X1("drive")
        Se("F") >> drive >> R("b_1", 0.1)
        drive >> body
        body >> I("m", 1.0)
        body >> R("b", 0.5)
        body >> C("k", stiffness=4.0, law=Polynomial(orders=(3,)))
        body >> Dq("x")
        drive >> Df("v", law=law)
    force = {"F": np.sin(2 * TIME)}
    plain = simulate(in_mode(g), TIME, force)
    same = simulate_modes(g, TIME, [(1.5, {"drive": True}), (3.21, {})], force)
    np.testing.assert_allclose(same["x"], plain["x"], atol=1e-4)
    np.testing.assert_allclose(same["v"], plain["v"], atol=1e-3)


def test_schedules_that_make_no_sense_are_refused() -> None:
    g = charger()
    with pytest.raises(UnusableInput, match="must rise"):
        simulate_modes(g, TIME, [(2.0, {}), (1.0, {})], STEP)
    with pytest.raises(UnusableInput, match="must rise"):
        simulate_modes(g, TIME, [(9.0, {})], STEP)
    with pytest.raises(UnknownName, match="switched junction 'swich'"):
        simulate_modes(g, TIME, [(1.0, {"swich": True})], STEP)
    with pytest.raises(UnusableInput, match="shape"):
        simulate_modes(g, TIME, [], {"V": np.ones(3)})
    with pytest.raises(UnknownName, match="state"):
        simulate_modes(g, TIME, [], STEP, start={"q_C": 1.0})
    with pytest.raises(UnknownName, match="inter-sample"):
        simulate_modes(g, TIME, [], STEP, hold="band-limited")
    with pytest.raises(GraphError, match="no switched junction"):
        simulate_modes(in_mode(g), TIME, [], STEP)
    with pytest.raises(UnusableInput, match="rise evenly"):
        simulate_modes(g, TIME**2, [], STEP)


def test_steps_of_nanoseconds_are_told_apart() -> None:
    for unit in (1.0, 1e-9):
        with charger() as g:
            g["node"] >> De("u", unit="V")
        t, at = unit * TIME, [(unit * 1.7049, {"switch": False})]
        run = simulate_modes(g, t, at, STEP, {"C_1": unit}, start={"q_C_1": 0.0})
        rise, peak = 0.8 * (1 - np.exp(-2.5 * TIME)), 0.8 * (1 - np.exp(-2.5 * 1.7049))
        fall = peak * np.exp(-(TIME - 1.7049) / 2)
        assert run["u"] == pytest.approx(np.where(TIME < 1.7049, rise, fall), rel=1e-9)


def meter(junction: Any, **sensor: Any) -> BondGraph:
    """A charge that is read behind a resistor; what switches never does."""
    with BondGraph("meter") as g:
        loop = junction("loop")
        Se("V", unit="V", drive=Drive(delay="tau")) >> loop >> R("R_1", 1.0)
        loop >> C("C_1", 0.05)
        loop >> Dq("q", **sensor)
    known = [Parameter("tau", 0.1, "s"), Parameter("lag", 0.025, "s"), Parameter("slow", 0.02, "1")]
    return g.with_parameters([*known, Parameter("rise", 0.3, "C")])


LATE = {"delay": "lag", "clock": "slow", "resolution": 1e-3}


def test_dead_times_and_clocks_are_those_of_a_plain_simulation() -> None:
    t = np.linspace(0.0, 1.0, 101)
    drive = {"V": np.sin(9.0 * t)}
    switched, plain = meter(X1, **LATE), simulate(meter(One, **LATE), t, drive)["q"]
    assert simulate_modes(switched, t, [(0.333, {})], drive)["q"] == pytest.approx(
        plain, abs=1.01e-3
    )
    compiled = simulate(compile_model(in_mode(switched)), t, drive)["q"]
    assert compiled == pytest.approx(plain, abs=1e-12)


@pytest.mark.parametrize("hold", ["hold", "linear"])
def test_a_sensor_drifts_once_along_the_record(hold: str) -> None:
    t, drive = np.linspace(0.0, 1.0, 101), {"V": np.zeros(101)}
    graph = meter(X1, drift=("rise", "slow"))
    plain = simulate(meter(One, drift=("rise", "slow")), t, drive, hold=hold)["q"]
    assert plain[-1] == pytest.approx(0.32, abs=0.01)
    apart = 0.004  # a sample of the drift, where the switch lies between two
    made = simulate_modes(graph, t, [(0.333, {})], drive, hold=hold)["q"]
    assert made == pytest.approx(plain, abs=apart)
    made = simulate_modes(graph, t, [(0.5, {}), (0.7, {})], drive, hold=hold)["q"]
    begun = [50, 70] if hold == "hold" else []  # what is held jumps there: the new mode's value
    assert made[begun] == pytest.approx(0.3 * t[begun] + 0.02 * t[begun] ** 2, abs=1e-9)
    assert np.delete(made, begun) == pytest.approx(np.delete(plain, begun), abs=1e-9)


def test_a_first_mode_begins_where_a_plain_simulation_does() -> None:
    """A slew limit starts from the command before the record, not from the first one."""

    def limited(junction: Any) -> BondGraph:
        with BondGraph("limited") as g:
            loop = junction("loop")
            Se("V", unit="V", drive=Drive(law=SlewLimit(2.0))) >> loop >> R("R_1", 0.5, unit="ohm")
            loop >> C("C_1", 1.0, unit="F")
            loop >> Dq("q")
        return g

    plain = simulate(limited(One), TIME, STEP)["q"]
    made = simulate_modes(limited(X1), TIME, [(2.0, {})], STEP)["q"]
    assert made == pytest.approx(plain, abs=1e-6)
    assert plain[100] < 0.4  # of 0.86 without a limit
