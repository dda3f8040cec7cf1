"""A base that moves: its velocity, displacement or acceleration may be what is recorded."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from bondgraph import (
    X0,
    X1,
    BondGraph,
    C,
    Da,
    Df,
    Dq,
    I,
    MSf,
    One,
    R,
    Reading,
    Se,
    Sf,
    Zero,
)  # fmt: skip
from bondgraph.analysis.linear import LAPLACE
from bondgraph.analysis.operator_equations import operator_equations
from bondgraph.equations.derivation import equations
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph.modulation import effort, flow
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Law, Polynomial
from bondgraph.signals.recorded_rates import slopes, with_rates
from bondgraph.signals.recording import Recording
from bondgraph.simulation.modes.guards import Guard, When
from bondgraph.simulation.modes.run import simulate_modes
from bondgraph.simulation.responses import step_response
from bondgraph.simulation.simulate import simulate as simulated
from bondgraph.simulation.simulate import simulate_general
from bondgraph.simulation.start import fine_inputs
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.errors import BondsightError, GraphError, UnusableInput
from identification.diagnosis.diagnose import diagnose
from identification.estimation.estimate import estimate
from identification.study.study import Study
from tests.settled import simulate
from tests.symbols import closed

UNITS = {"value": "m/s", "rate": "m/s^2", "integral": "m"}
OMEGA = 9.0
CUBIC = Polynomial(orders=(3,), size=1.0)


def shaken(given: str, *sensors: Sensor, law: Law | None = None) -> BondGraph:
    with BondGraph("shaken") as g:
        base, s, gap, body = (
            Sf("b", unit=UNITS[given], given=given),
            Zero("s"),
            One("gap"),
            One("m_"),
        )
        base >> s >> body >> I("m", 0.3, unit="kg")
        s >> gap >> C("k", stiffness=200.0, unit="N/m", law=law)
        gap >> R("d", 0.8, unit="N*s/m")
        for sensor in sensors or (Dq("x", unit="m"), Df("v", unit="m/s")):
            if sensor.name not in g.elements:
                g.add(sensor)
            if not isinstance(sensor, Reading):
                body >> sensor
    return g


def recorded(t: np.ndarray) -> dict[str, np.ndarray]:
    return {
        "value": np.sin(OMEGA * t),
        "rate": OMEGA * np.cos(OMEGA * t),
        "integral": (1 - np.cos(OMEGA * t)) / OMEGA,
    }


def error(n: int, given: str, law: Law | None = None) -> float:
    """Largest difference to the run by the velocity, over what moves."""
    t = np.linspace(0, 2, n)
    values = {"a_3_k": 5e4} if law else {}
    fine = np.linspace(0, 2, 32001)
    right = simulate(shaken("value", law=law), fine, {"b": recorded(fine)["value"]}, values)
    found = simulate(shaken(given, law=law), t, {"b": recorded(t)[given]}, values)
    every = 32000 // (n - 1)
    x = np.asarray(right["x"])[::every]
    return float(np.abs(np.asarray(found["x"]) - x).max() / np.ptp(x))


@pytest.mark.parametrize("law", [None, CUBIC])
@pytest.mark.parametrize("given", ["rate", "integral"])
def test_whatever_is_recorded_the_body_moves_alike(given: str, law: Law | None) -> None:
    coarse, fine = error(501, given, law), error(1001, given, law)
    assert coarse < 1e-3
    if given == "integral" and law is None:
        # the spline's own error is of a higher order: less than the reference's, which hides it
        assert max(coarse, fine) < 1e-7
    else:  # the recording between its samples is the only error: of second order
        assert coarse / fine > 3.0


@pytest.mark.parametrize(
    "sensors", [(), (Dq("x"),), (Df("v"), Da("a")), (Dq("x"), Reading("f", effort("k")))]
)
def test_states_keep_their_names_whatever_is_read(sensors: tuple[Sensor, ...]) -> None:
    """p' = d (v - p / m) + k q and q' = v - p / m, v the rate of what is recorded."""
    space = closed(equations(shaken("integral", *sensors)))
    values = {s.name: s for e in space.dxdt for s in e.free_symbols}
    d, m, k, v, p, q = (values[n] for n in ("d", "m", "k", "d_b", "p_m", "q_k"))
    gap = v - p / m
    wanted = {"p_m": d * gap + k * q, "q_k": gap}
    states = [str(x) for x in space.x]
    assert states[:2] == ["p_m", "q_k"]
    for state, rate in zip(states[:2], space.dxdt, strict=False):
        assert sp.simplify(rate - wanted[state]) == 0, state


@pytest.mark.parametrize("law", [None, CUBIC])
def test_an_accelerometer_beside_a_recorded_displacement(law: Law | None) -> None:
    """Within the error that is told: h^2 / 12 of the base's jerk, through the damper."""
    t, fine = np.linspace(0, 2, 501), np.linspace(0, 2, 32001)
    values = {"a_3_k": 5e4} if law else {}
    sensors = (Da("a", unit="m/s^2"), Dq("x", unit="m"))
    wanted = simulate(
        shaken("rate", *sensors, law=law), fine, {"b": recorded(fine)["rate"]}, values
    )
    found = simulate(
        shaken("integral", *sensors, law=law), t, {"b": recorded(t)["integral"]}, values
    )
    told = 0.8 / 0.3 * t[1] ** 2 / 12 * OMEGA**2
    wrong = np.abs(np.asarray(found["a"]) - np.asarray(wanted["a"])[::64]).max()
    assert wrong < 1.5 * told + 1e-4 * np.ptp(wanted["a"])
    assert np.asarray(found["x"]) == pytest.approx(np.asarray(wanted["x"])[::64], abs=1e-4)


def test_a_spring_on_a_recorded_displacement_is_read() -> None:
    t = np.linspace(0, 2, 1001)
    read = {}
    for given in ("value", "integral"):
        graph = shaken(given)
        graph = graph.with_branch("gap", [Dq("q", unit="m")])
        read[given] = np.asarray(simulate(graph, t, {"b": recorded(t)[given]})["q"])
    assert np.abs(read["integral"] - read["value"]).max() < 1e-4 * np.ptp(read["value"])


def test_both_engines_and_every_sub_step_agree() -> None:
    graph = shaken("integral", Da("a", unit="m/s^2"), Dq("x", unit="m"))
    other = shaken(
        "integral",
        Da("a", unit="m/s^2"),
        Dq("x", unit="m"),
        Reading("P", effort("k") * flow("gap")),
    )
    t = np.linspace(0, 2, 401)
    runs = [simulate(g, t, {"b": recorded(t)["integral"]}) for g in (graph, other)]
    for n in ("a", "x"):
        one, two = (np.asarray(r[n]) for r in runs)
        assert np.abs(one - two).max() < 1e-3 * np.ptp(one), n


def test_each_recording_has_rates_of_its_own() -> None:
    t = np.arange(50) * 0.1
    way = np.concatenate([np.sin(t), 5.0 + np.cos(t)])
    rate = slopes(way, 0.1, (50,))
    assert rate == pytest.approx(np.concatenate([np.cos(t), -np.sin(t)]), abs=5e-4)


def test_the_rate_makes_the_way_that_is_recorded() -> None:
    rng = np.random.default_rng(0)
    way, h = rng.standard_normal(40), 0.02
    u = np.stack([way, slopes(way, h)], axis=1)
    for n_sub in (1, 4):
        _, fine = with_rates(("b", "d_b"), ("d_b",), u, fine_inputs(u, n_sub, "linear"), h)
        gone = fine[:, :, 1].mean(axis=1).reshape(-1, n_sub).sum(axis=1) * h / n_sub
        assert gone == pytest.approx(np.diff(way))


def test_what_jumps_with_the_base_wants_another_record() -> None:
    graph = shaken("integral").with_branch("gap", [Da("a", unit="m/s^2")])
    t = np.linspace(0, 1, 101)
    with pytest.raises(BondsightError, match=r"d2_b.*record the rate of b"):
        simulate(graph, t, {"b": recorded(t)["integral"]})


def test_what_needs_the_rate_itself_takes_the_general_engine() -> None:
    graph = shaken("integral", Da("a", unit="m/s^2"))
    assert equations(graph).input_rates == ("d_b",)
    t = np.linspace(0, 2, 8001)
    run = simulate(graph, t, {"b": recorded(t)["integral"]})
    right = simulate(shaken("rate", Da("a", unit="m/s^2")), t, {"b": recorded(t)["rate"]})
    a, wanted = np.asarray(run["a"]), np.asarray(right["a"])
    assert np.abs(a - wanted)[10:].max() < 5e-3 * np.ptp(wanted)


def test_a_sensor_that_only_reads_changes_no_motion() -> None:
    t = np.linspace(0, 1, 2001)
    moving = np.sin(OMEGA * t) / OMEGA
    plain = shaken("integral", Df("v", unit="m/s"))
    both = shaken("integral", Df("v", unit="m/s"), Da("a", unit="m/s^2"))
    v, again = (np.asarray(simulate(g, t, {"b": moving})["v"]) for g in (plain, both))
    assert v[0] == again[0] == 0.0
    assert np.abs(v - again).max() < 2e-2 * np.ptp(v)


def test_an_accelerometer_on_a_shaken_base_reads_exactly() -> None:
    t = np.linspace(0, 2, 4001)
    graph = shaken("rate", Da("a", unit="m/s^2"), Df("v", unit="m/s"))
    run = simulate(graph, t, {"b": recorded(t)["rate"]})
    v = np.asarray(run["v"])
    difference = (v[2:] - v[:-2]) / (2 * t[1])
    assert np.abs(difference - np.asarray(run["a"])[1:-1]).max() < 1e-4 * np.ptp(difference)


def test_operator_equations_integrate_and_differentiate() -> None:
    for given, times in (("value", 1), ("rate", 1 / LAPLACE), ("integral", LAPLACE)):
        found = operator_equations(shaken(given)).equations
        (row,) = (e for e in found if e.element == "b")
        assert sp.simplify(dict((n, c) for c, n in row.known)["b"] + times) == 0


def test_a_file_keeps_it() -> None:
    again = from_json(to_json(shaken("rate")))
    assert again["b"] == Sf("b", unit="m/s^2", given="rate")


def test_a_unit_of_something_else_and_a_wrong_word_are_told() -> None:
    graph = shaken("rate").with_element("b", unit="m/s")
    assert any("b (Sf" in line or "b:" in line for line in graph.check())
    graph = shaken("rate").with_element("b", given="speed")
    assert any("speed" in line and "rate" in line for line in graph.check())
    with pytest.raises(GraphError, match="leave out given"):
        shaken("value").replace("b", MSf("b", 2.0, unit="m/s", given="rate"))


def test_a_force_by_its_rate() -> None:
    with BondGraph("pushed") as g:
        v = One("v")
        Se("F", unit="N/s", given="rate") >> v >> I("m", 0.5, unit="kg")
        v >> R("d", 2.0, unit="N*s/m")
        v >> Df("speed", unit="m/s")
    assert g.check() == ()
    t = np.linspace(0, 1, 1001)
    run = simulate(g, t, {"F": np.full(t.size, 3.0)}, x0={"u_F": 0.0, "p_m": 0.0})
    # m v' + d v = 3 t
    expected = 1.5 * t - 0.375 * (1 - np.exp(-4 * t))
    assert np.asarray(run["speed"]) == pytest.approx(expected, abs=1e-6)


def test_a_recorded_rate_that_does_not_begin_at_zero_starts_in_both_engines() -> None:
    """An integral of the inputs has no rest: it starts at 0 while everything else rests."""
    rate = 2.0 + np.sin(OMEGA * (t := np.linspace(0, 1, 501)))
    exact = simulate(shaken("rate"), t, {"b": rate})
    general = simulate_general(shaken("rate"), t, {"b": rate}, x0="rest", hold="linear")
    assert np.asarray(general["v"]) == pytest.approx(np.asarray(exact["v"]), abs=1e-5)


@pytest.mark.parametrize("law", [None, CUBIC])
@pytest.mark.parametrize("given", ["rate", "integral"])
def test_nobody_has_to_say_that_a_measured_motion_is_not_held(given: str, law: Law | None) -> None:
    t = np.linspace(0, 2, 501)
    commands, values = {"b": recorded(t)[given]}, {"a_3_k": 5e4} if law else {}
    graph = shaken(given, law=law)
    usual = simulated(graph, t, commands, values)
    assert usual.hold == "linear"
    said = simulated(graph, t, commands, values, hold="linear")
    assert np.array_equal(usual["x"], said["x"])
    general = simulate_general(graph, t, commands, values)
    assert general.hold == "linear"
    assert simulated(shaken("value"), t, {"b": recorded(t)["value"]}).hold == "hold"


def stiff() -> BondGraph:
    """A mass that the base moves at once, and another one on a spring."""
    with BondGraph("stiff") as g:
        base, s, body, gap = One("base"), Zero("s"), One("body"), One("gap")
        Sf("b", unit="m/s") >> base >> I("M", 3.0, unit="kg")
        base >> s >> body >> I("m", 1.0, unit="kg")
        s >> gap >> C("k", stiffness=400.0, unit="N/m")
        gap >> R("d", 2.0, unit="N*s/m")
        body >> Df("v", unit="m/s")
        base >> Da("a", unit="m/s^2")
    return g


def test_a_rate_that_the_equations_need_makes_the_input_linear() -> None:
    t = np.linspace(0, 1, 401)
    commands = {"b": recorded(t)["value"]}
    run = simulated(stiff(), t, commands)
    assert run.hold == "linear"
    assert np.asarray(run["a"])[5:] == pytest.approx(
        OMEGA * np.cos(OMEGA * t)[5:], abs=OMEGA**2 / 400
    )
    for way in (
        lambda: simulated(stiff(), t, commands, hold="hold"),
        lambda: estimate(Study(stiff(), as_recording(t, run), ("k",), hold="hold")),
        lambda: diagnose(stiff(), as_recording(t, run), hold="hold"),
    ):
        with pytest.raises(UnusableInput, match="need d_b, but an input that is held jumps"):
            way()
    found = estimate(Study(stiff(), as_recording(t, run), ("k",)))
    assert found.setting.hold == "linear"
    assert found.values["k"] == pytest.approx(400.0, rel=0.02)
    with pytest.raises(UnusableInput, match="need the rate of b, and what jumps has none"):
        step_response(stiff(), t)


def as_recording(t: np.ndarray, run: Trajectory) -> Recording:
    rng = np.random.default_rng(1)
    noisy = {n: v + 1e-3 * np.ptp(v) * rng.standard_normal(t.size) for n, v in run.outputs.items()}
    channels = {"b": recorded(t)["value"], **noisy}
    return Recording("run", t, channels, {"b": "m/s", "v": "m/s", "a": "m/s^2"})


@pytest.mark.parametrize("given", ["rate", "integral"])
def test_a_base_under_a_switched_spring(given: str) -> None:
    def held(by: str) -> BondGraph:
        with BondGraph("held") as g:
            s, body, gap = Zero("s"), One("body"), X1("gap")
            Sf("b", unit=UNITS[by], given=by) >> s >> body >> I("m", 0.3, unit="kg")
            s >> R("d", 2.0, unit="N*s/m")
            s >> gap >> C("k", stiffness=200.0, unit="N/m")
            body >> Df("v", unit="m/s")
        return g

    t, fine = np.linspace(0, 1, 401), np.linspace(0, 1, 16001)
    schedule = [(0.5012, {"gap": False})]
    run = simulate_modes(held(given), t, schedule, {"b": recorded(t)[given]})
    right = simulate_modes(held("value"), fine, schedule, {"b": recorded(fine)["value"]})
    assert np.asarray(run["v"]) == pytest.approx(np.asarray(right["v"])[::40], abs=1e-3)
    if given == "integral":
        with pytest.raises(UnusableInput, match="recorded of b, but an input that is held jumps"):
            simulate_modes(held(given), t, schedule, {"b": recorded(t)[given]}, hold="hold")


def test_a_stop_on_a_base_whose_displacement_is_recorded() -> None:
    """The crossing follows the spline through the record, not a line between its samples."""
    with BondGraph("stop") as g:
        s, body, contact, pad = Zero("s"), One("body"), X0("contact", on=False), One("pad")
        Sf("b", unit="m", given="integral") >> s >> body >> I("m", 0.3, unit="kg")
        s >> R("d", 2.0, unit="N*s/m")
        s >> C("k", stiffness=200.0, unit="N/m")
        body >> contact >> pad >> C("k_c", stiffness=500.0, unit="N/m")
        body >> Dq("x")
    guard = Guard("contact", on=When("x", above=0.02), off=When(effort("contact"), below=0.0))
    times = []
    for count in (401, 6401):
        t = np.linspace(0, 1, count)
        run = simulate_modes(g, t, (), {"b": recorded(t)["integral"]}, events=[guard])
        times.append([e.time for e in run.events])
    assert len(times[0]) == 4
    assert times[0] == pytest.approx(times[1], abs=1e-7)
