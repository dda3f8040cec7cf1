"""Simulation: memory, energy, dry friction, inputs, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuators import stack_bond_graph
from actuators.models.catalogue import MODELS
from actuators.models.textbook import resonator
from bondgraph import (
    BondGraph,
    C,
    Df,
    Dq,
    I,
    One,
    R,
    Se,
    Sf,
    UnknownName,
    UnusableInput,
    simulate,
)
from bondgraph.energy.bond_power import observables
from bondgraph.energy.ledger import ledger
from bondgraph.hysteresis import MaxwellResistiveCapacitor, play_record
from bondgraph.laws import (
    Backlash,
    Bilinear,
    Coulomb,
    DahlFriction,
    Hysteretic,
    Law,
    Onset,
    Polynomial,
    StopSum,
    Stribeck,
    TableLaw,
)
from bondgraph.simulation.exact_run import relative_change, run_record
from bondgraph.simulation.lure import compile_model
from tests.spring import spring

SLIPS = (2e-8, 5e-8, 1.2e-7, 3e-7)  # C m, of the dipole


def stack_with_stops() -> tuple[Any, Any]:
    law = StopSum(SLIPS, height=1e9, scale=1e9)
    graph = stack_bond_graph(law, sensors=("x", "i"), external_force=True)
    return graph, law


def block(damping: float = 0.0, **law: Any) -> BondGraph:
    with BondGraph("block") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> C("k", stiffness=100.0)
        body >> R("mu", damping, law=Coulomb(**(law or {"force": 2.0})))
        body >> Dq("x")
        body >> Df("v")
    return g


def anchors(s: Any, r: float) -> Any:
    return play_record(s, np.array([r]), np.zeros(1))[:, 0]


def test_a_trajectory_becomes_a_dataset_as_a_recording_does() -> None:
    pytest.importorskip("xarray")
    t = np.arange(20) * 0.01
    run = simulate(spring(), t, {"F": np.ones(20)})
    data = run.to_xarray()
    np.testing.assert_array_equal(data["x"].values, run["x"])
    np.testing.assert_array_equal(data["time"].values, t)
    assert data["x"].attrs["units"] == "m"
    assert data["time"].attrs["units"] == "s"
    assert data.attrs["name"] == run.name


# -- hysteresis ---
def test_memory_is_advanced_only_by_accepted_steps() -> None:
    """The operator run over the accepted arguments gives the law again, bit for bit of rounding."""
    graph, _law = stack_with_stops()
    compiled = compile_model(graph)
    rng = np.random.default_rng(1)
    u = np.zeros((400, 2))
    u[:, 0] = np.cumsum(rng.normal(size=400)) * 5
    run = run_record(compiled, compiled.nominal(), u, 2e-5, np.zeros(compiled.n_x))
    s, w = run.s[:, 0], run.w[:, 0]
    expected = np.zeros_like(s)
    for r in SLIPS:
        expected += 1e9 * (s - anchors(s, r))
    np.testing.assert_allclose(w, expected, atol=1e-12 * np.abs(expected).max())


def test_quasi_static_loop_is_rate_independent() -> None:
    """Slow loops of two rates and two samplings are one curve over the input."""
    graph, _ = stack_with_stops()
    loops = []
    for period, n in ((1.0, 400), (4.0, 400), (1.0, 1600)):
        phase = np.arange(2 * n + 1) / n
        volt = 50 - 50 * np.cos(2 * np.pi * phase)
        drive = {"V_in": volt, "F_e": 0 * volt}
        run = simulate(graph, phase * period, drive, hold="linear", accuracy=1e-6)
        loops.append(run["x"][n :: n // 400])
    span = np.ptp(loops[0])
    # the lead (7.5 us) and the damping are the only clocks: 5e-5 of a period of 1 s
    assert np.abs(loops[1] - loops[0]).max() < 1e-4 * span
    assert np.abs(loops[2] - loops[0]).max() < 1e-6 * span


def test_turning_points_suffice() -> None:
    """A record of turning points leaves the same state as a finely sampled one."""
    operator = MaxwellResistiveCapacitor.stack_2hz()
    with BondGraph("loop") as g:
        loop = One("loop")
        Se("V") >> loop >> C("C_1", 1.5e-6)
        loop >> C("H", law=Hysteretic(operator))
    corners = np.array([0.0, 80.0, 20.0, 60.0, 5.0, 100.0, 0.0])
    fine = np.interp(np.linspace(0, 6, 601), np.arange(7), corners)
    options: dict[str, Any] = {"observed": ("q_H",), "hold": "linear", "accuracy": 1e-9}
    rough = simulate(g, np.arange(7.0), {"V": corners}, **options)
    dense = simulate(g, np.linspace(0, 6, 601), {"V": fine}, **options)
    np.testing.assert_allclose(rough["q_H"], dense["q_H"][::100], rtol=1e-12, atol=1e-17)


# -- energy ---
def test_energy_ledger_of_the_stack_with_stops() -> None:
    """Input - losses - change of the stored energy = 0 to 2e-5 of the input (trapezoid)."""
    graph, law = stack_with_stops()
    n, step = 40000, 1e-7
    time = step * np.arange(n + 1)
    volt = 40 * np.sin(2 * np.pi * 900 * time) ** 2 * np.where(time < 2e-3, 1, 1.5)
    volt = np.convolve(volt, np.ones(200) / 200, "same")
    volt[:200] = volt[200] * np.arange(200) / 200
    force = 100 * np.sin(2 * np.pi * 1500 * time)
    names = ("f_loop", "f_body", "q_C_nl", "q_k", "p_m")
    compiled = compile_model(graph, names)
    p = compiled.nominal()
    value = dict(zip(compiled.parameter_names, p, strict=True))
    u = np.column_stack([volt, force])
    run = run_record(compiled, p, u, step, np.zeros(compiled.n_x))
    i, v, dipole, x1, mom = run.y[:, compiled.n_y :].T

    def over_time(power: Any) -> float:
        return float(np.sum(0.5 * (power[1:] + power[:-1])) * step)

    electrical = over_time(volt * i)
    mechanical = over_time(force * v)
    heat = over_time(value["R_e"] * i**2) + over_time(value["R_nl"] * v**2)
    stored = 0.5 * mom[-1] ** 2 / value["m"] + 0.5 * value["k"] * x1[-1] ** 2
    stored += 0.5 * dipole[-1] ** 2 / value["C_nl"]
    slipped = 0.0
    for r in law.thresholds:
        anchor = anchors(dipole, r)
        stored += 0.5 * law.height * (dipole[-1] - anchor[-1]) ** 2
        slipped += law.height * r * np.abs(np.diff(anchor)).sum()
    assert slipped > 0.01 * electrical  # the test sees the stops
    assert heat > 0.001 * electrical
    residual = electrical + mechanical - heat - slipped - stored
    assert abs(residual) < 2e-5 * (abs(electrical) + abs(mechanical))


# -- dry friction ---
def test_block_loses_2_fc_over_k_each_half_cycle_and_sticks() -> None:
    """Amplitude A -> A - 2 F_c/k each half cycle (4 F_c/k each cycle), then rest for good."""
    graph = block()
    time = np.arange(4501) * 1e-3
    compiled = compile_model(graph)
    x0 = np.array([0.51 if n == "q_k" else 0.0 for n in compiled.states])
    run = run_record(compiled, compiled.nominal(), np.zeros((4501, 1)), 1e-3, x0, n_sub=16)
    x, v = run.y.T
    going = np.sign(np.where(np.abs(v) > 1e-9, v, 0.0))
    on = np.flatnonzero(going)
    turns = [0, *on[1:][np.diff(going[on]) != 0]]
    assert len(turns) == 13
    np.testing.assert_allclose(np.abs(x[turns]), 0.51 - 0.04 * np.arange(13), atol=4e-5)
    stuck = time > 13 * np.pi / 10 + 0.01
    assert np.abs(v[stuck]).max() < 1e-17
    assert np.ptp(x[stuck]) < 1e-12
    np.testing.assert_allclose(x[-1], 0.01, atol=2e-5)
    np.testing.assert_allclose(run.w[stuck, 0], -100 * x[stuck], rtol=1e-6)


def test_sticking_friction_follows_a_jump_of_the_force() -> None:
    """1.5 N < F_c: it must not move, and friction must be 1.5 N and not ring about it."""
    time = np.arange(101) * 1e-2
    force = np.where(time > 0.5, 1.5, 0.0)
    run = simulate(block(), time, {"F": force}, x0=np.zeros(2), hold="hold")
    assert np.abs(run["x"]).max() < 1e-9
    np.testing.assert_allclose(run.laws["mu"][1][time > 0.53], 1.5, rtol=1e-6)


def free_block(law: Law) -> BondGraph:
    with BondGraph("block") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("mu", 0.0, law=law)
        body >> Df("v")
    return g


def test_friction_that_falls_with_speed_holds_what_sticks() -> None:
    """With the whole force, from the start and after a slide; without a fall it is Coulomb's."""
    t = 1e-3 * np.arange(400)
    push = np.where(t < 0.2, 0.5, 0.3)
    slide = np.where(t < 0.3, 2.0 * np.sin(8.0 * np.pi * t), 0.0)
    slid = {}
    for law in (Coulomb(0.8), Stribeck(0.8, 0.0, 0.01), Stribeck(0.8, 0.4, 0.01)):
        graph = free_block(law)
        held = simulate(graph, t, {"F": push})
        assert held["v"] == pytest.approx(np.zeros(400), abs=1e-12)
        before = np.append(push[0], push[:-1])  # held until the sample
        assert held.laws["mu"][1][1:] == pytest.approx(before[1:], abs=1e-12)
        made = simulate(graph, t, {"F": slide}, observed=observables(graph))
        assert np.abs(made["v"]).max() > 0.01
        assert made["v"][-50:] == pytest.approx(np.zeros(50), abs=1e-12)
        assert made.laws["mu"][1][-50:] == pytest.approx(np.zeros(50), abs=1e-12)
        assert ledger(graph, made).closes
        slid[law] = made["v"]
    coulomb, level, fallen = slid.values()
    assert level == pytest.approx(coulomb, abs=1e-12)
    assert np.abs(fallen - coulomb).max() > 0.01


def test_friction_that_falls_with_speed_lets_go_at_its_top() -> None:
    """A rising force against 1.2 N that fall to 0.8 N, beside an integrator of others."""
    t = 1e-3 * np.arange(401)
    run = simulate(
        free_block(Stribeck(0.8, 0.4, 0.05)), t, {"F": 4.0 * t}, hold="linear", accuracy=1e-5
    )

    def rate(at: float, v: Any) -> Any:
        return 4.0 * at - 0.8 - 0.4 * np.exp(-((v / 0.05) ** 2))

    right = solve_ivp(rate, (0.3, 0.4), [0.0], t_eval=t[300:], rtol=1e-10, atol=1e-13).y[0]
    assert run["v"][:301] == pytest.approx(np.zeros(301), abs=1e-12)
    assert run["v"][300:] == pytest.approx(right, abs=1e-3 * right[-1])


def test_breakaway_starts_at_the_friction_level() -> None:
    time = np.linspace(0, 1, 1001)
    run = simulate(block(), time, {"F": 4.0 * time}, x0=np.zeros(2))
    moving = np.flatnonzero(np.abs(run["v"]) > 1e-9)[0]
    assert time[moving] == pytest.approx(0.5, abs=2.1e-3)


# -- inputs ---
def test_holds() -> None:
    """A ramp into an integrator: exact for a line, half a sample late for a staircase."""
    with BondGraph("tank") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> Df("v")
    time = np.arange(11) * 0.1
    for hold, expected in (
        ("linear", time**2 / 2),
        ("hold", time**2 / 2 - 0.05 * time),
    ):
        run = simulate(g, time, {"F": time}, hold=hold)
        np.testing.assert_allclose(run["v"], expected, atol=1e-12)
    wave = np.sin(2 * np.pi * np.arange(40) / 8)
    run = simulate(g, np.arange(40.0), {"F": wave}, hold="band-limited", accuracy=1e-6)
    exact = (1 - np.cos(2 * np.pi * np.arange(40) / 8)) * 4 / np.pi
    error = (run["v"] - exact)[12:-12]  # the ends of the record are not band-limited
    assert np.ptp(error) < 0.01


def test_starts_at_rest_under_the_first_input() -> None:
    run = simulate(resonator(), np.arange(50) * 1e-4, {"u": np.full(50, 0.4)}, x0="rest")
    np.testing.assert_allclose(run["y"], 0.5, rtol=1e-9)


CUBIC = Polynomial(half=0.1, size=10.0, orders=(3,), unit="N")


@pytest.mark.parametrize(
    ("law", "values", "rest"),
    [
        (CUBIC, {"a_3_k": 10.0}, 0.0682327803828),  # 100 x + 10 (x / 0.1)^3 = 10
        (Backlash(coefficient="k", width=0.25), {}, 0.35),
        (
            StopSum((0.01, 0.05)),
            {"h_1_k": 200.0, "h_2_k": 100.0},
            0.1,
        ),  # relaxed: they carry nothing
        (Hysteretic(MaxwellResistiveCapacitor((60.0, 40.0), (2.0, 50.0))), {}, 0.2),  # 2 + 40 x
        (None, {}, 0.1),
    ],
    ids=["cubic", "gap", "stops", "slips", "linear"],
)
def test_rest_holds_with_its_laws(law: Law | None, values: dict[str, float], rest: float) -> None:
    t = 1e-2 * np.arange(200)
    graph = spring(1.0, 5.0, 100.0, law, Coulomb(0.5), speed="v")
    run = simulate(graph, t, {"F": np.full(200, 10.0)}, values, x0="rest")
    assert run["v"] == pytest.approx(np.zeros(200), abs=1e-9)
    assert np.ptp(run["x"]) < 1e-9
    assert run["x"][0] == pytest.approx(rest, rel=1e-9)


def test_a_preloaded_spring_rests_beside_dry_friction() -> None:
    """The linear part rests at zero, so that it says nothing of what is rounding."""
    t, law = 1e-2 * np.arange(100), Bilinear(50.0, knee=-1e-2)
    run = simulate(spring(1.0, 5.0, 100.0, law, Coulomb(0.5), speed="v"), t, {"F": np.zeros(100)})
    assert run["x"][0] == pytest.approx(-0.5 / 150.0, rel=1e-6)
    assert run["v"] == pytest.approx(np.zeros(100), abs=1e-9)


def test_no_rest_with_its_laws_is_said() -> None:
    """A spring that gives way bears no more than its level."""
    t, law = 1e-2 * np.arange(3), TableLaw((-0.05, 0.05), (-5.0, 5.0), reference=100.0)
    with pytest.warns(UserWarning, match=r"no rest with its laws is found .* \(k\)"):
        run = simulate(spring(law=law), t, {"F": np.full(3, 10.0)}, x0="rest")
    assert run["x"][0] == pytest.approx(0.1)


def test_refusals() -> None:
    g = resonator()
    t, u = np.arange(5) * 1e-4, np.zeros(5)
    with pytest.raises(UnusableInput, match="at least two samples"):
        simulate(g, t[:1], {"u": u[:1]})
    with pytest.raises(UnusableInput, match="rise evenly"):
        simulate(g, t**2, {"u": u})
    with pytest.raises(UnusableInput, match="input u has shape"):
        simulate(g, t, {"u": u[:-1]})
    with pytest.raises(UnusableInput, match="NaN or infinity"):
        simulate(g, t, {"u": u * np.nan})
    with pytest.raises(UnknownName, match="inter-sample"):
        simulate(g, t, {"u": u}, hold="liner")
    with pytest.raises(UnknownName, match="'u'"):
        simulate(g, t, {"U": u})
    with pytest.raises(UnknownName, match=r"Did you mean 'm'|Known: m"):
        simulate(g, t, {"u": u}, {"M": 1.0})
    with pytest.raises(UnknownName, match="y"):
        simulate(g, t, {"u": u})["Y"]


def test_a_run_goes_on_from_the_memory_and_state_of_another() -> None:
    law = Hysteretic(MaxwellResistiveCapacitor((3.0, 2.0, 1.0), (0.2, 0.4, 0.5)))
    with BondGraph("positioner") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("d", 0.8)
        body >> C("k", law=law)
        body >> C("guide", stiffness=1.0)
        body >> Dq("x")
    t = 0.02 * np.arange(600)
    force = 2.0 * np.sin(1.7 * t) + 0.8 * np.sin(5.1 * t)
    whole = simulate(g, t, {"F": force}, accuracy=1e-7)
    first = simulate(g, t[:251], {"F": force[:251]}, accuracy=1e-7)
    assert set(first.memory) == {"k"}
    options: dict[str, Any] = {"x0": first.state, "accuracy": 1e-7}
    second = simulate(g, t[250:], {"F": force[250:]}, memory=first.memory, **options)
    size = np.ptp(whole["x"])
    np.testing.assert_allclose(second["x"], whole["x"][250:], rtol=0, atol=1e-5 * size)
    forgotten = simulate(g, t[250:], {"F": force[250:]}, **options)
    assert np.abs(forgotten["x"] - whole["x"][250:]).max() > 2e-3 * size
    with pytest.raises(UnknownName, match="'kk'"):
        simulate(g, t, {"F": force}, memory={"kk": (0.0, 0.0, 0.0)})
    with pytest.raises(UnusableInput, match="has 3 memory states"):
        simulate(g, t, {"F": force}, memory={"k": (0.0,)})


def test_the_memory_of_one_law_leaves_the_others_at_rest() -> None:
    """Without it the stops would push on the way to the memory that friction begins with."""
    g = spring(1.0, 5.0, 100.0, StopSum((0.01,)), DahlFriction(0.5, 1e-3), speed="v")
    t, given = 0.01 * np.arange(3), {"h_1_k": 200.0}
    one, both = (
        simulate(g, t, {"F": np.ones(3)}, given, memory={"k": (-0.02,), **rest})["v"]
        for rest in ({}, {"d": (0.0, 0.0)})
    )
    np.testing.assert_allclose(one, both, rtol=1e-9, atol=1e-12)


def test_time_begins_with_a_record_that_begins_with_a_step() -> None:
    g = spring(1.0, 5.0, 100.0, Onset(0.05, 0.01, 0.01), speed="v")
    t, given = 0.01 * np.arange(11), {"h_k": 50.0}
    force = {"F": np.ones(t.size)}
    wanted = simulate(g, t, force, given, memory={"k": (0.0,)})["v"]
    np.testing.assert_allclose(simulate(g, t, force, given)["v"], wanted, rtol=1e-9, atol=1e-12)


def test_rest_under_a_flow_that_only_charges() -> None:
    """A current into a capacitor never rests; the start stays at zero instead of far away."""
    with BondGraph("charged") as g:
        node = One("node")
        Sf("i") >> node >> C("C_1", 2e-6)
        node >> C("C_2", law=Hysteretic(MaxwellResistiveCapacitor((1e5,), (1.0,))))
        node >> Dq("q")
    t = 1e-4 * np.arange(50)
    run = simulate(g, t, {"i": np.full(t.size, 1e-3)}, x0="rest")
    assert run["q"][0] == pytest.approx(0.0, abs=1e-12)
    assert run["q"][-1] == pytest.approx(1e-3 * t[-1], rel=1e-9)


def test_a_memory_is_as_accurate_as_asked_for() -> None:
    """One sub-step and two agree by accident, both further off than what was asked for."""
    volt = 50 - 50 * np.cos(2 * np.pi * 5e-3 * np.arange(201))
    volt = volt + 15 * np.sin(2 * np.pi * 33e-3 * np.arange(201))
    graph, time = MODELS["stack_lumped_maxwell"](), 1e-4 * np.arange(201)
    exact = simulate(graph, time, {"V_in": volt}, x0="rest", hold="linear", accuracy=1e-7)
    for accuracy in (1e-3, 1e-4, 1e-5):
        found = simulate(graph, time, {"V_in": volt}, x0="rest", hold="linear", accuracy=accuracy)
        assert relative_change(found["x"][:, None], exact["x"][:, None]) < accuracy


def test_a_command_that_is_missing_is_named() -> None:
    with BondGraph("turning") as g:
        s = One("s")
        Se("T", unit="N*m") >> s >> I("J", 1e-3, unit="kg*m2")
        s >> Df("w", unit="rad/s")
    with pytest.raises(UnknownName, match=r"turning: the command T is missing \(given: none\)"):
        simulate(g, np.arange(5) * 0.1, {})
    with pytest.raises(UnusableInput, match=r"not a function; call it, block\(\)"):
        simulate(block, np.arange(5) * 0.1)  # type: ignore[arg-type]
