"""Guards and schedules where a mode needs the general step, against SciPy and closed forms."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph import (
    BondGraph,
    C,
    De,
    Df,
    Dq,
    GraphError,
    I,
    One,
    R,
    Se,
    Zero,
    displacement,
    effort,
    flow,
)
from bondgraph.graph.elements import MTF, X0, X1, CField, IField, MSe
from bondgraph.graph.modulation import TIME
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Coulomb, Hysteretic
from bondgraph.simulation import lure
from bondgraph.simulation.modes.guards import Guard, When
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.simulation.modes.run import simulate_modes
from bondgraph.simulation.simulate import simulate
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.errors import BondsightError, UnusableInput
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

ANGLE = sp.Symbol("q1", real=True)


@pytest.fixture
def general_step(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Take the exact step away from the modes that are made from then on."""

    def taken() -> None:
        monkeypatch.setattr(lure, "exact_form", lambda model, observed=(): None)

    return taken


# -- a pendulum -------------------------------------------------------------------------------
def pendulum(friction: Coulomb | None = None) -> BondGraph:
    """A rigid pendulum that swings against the spring of a stop."""
    with BondGraph("pendulum") as g:
        shaft, stop = One("shaft"), X0("stop", on=False)
        Se("T", unit="N*m") >> shaft >> I("J", 0.5, unit="kg*m^2")
        shaft >> CField("gravity", energy=4.0 * (1 - sp.cos(ANGLE)), ports=1)
        shaft >> stop >> C("pad", stiffness=300.0, unit="N*m/rad")
        if friction:
            shaft >> R("b", 0.1, unit="N*m*s/rad", law=friction)
        shaft >> Dq("phi", unit="rad")
        shaft >> Df("w", unit="rad/s")
    return g


STOP = Guard("stop", on=When("phi", above=0.4), off=When(effort("stop"), below=0.0))
SWING = {"q_gravity1": -2.0, "p_J": 0.0}


def swung(t: Any, torque: Any) -> tuple[Any, list[tuple[float, str]]]:
    """Angle and speed by SciPy, and the events."""

    def pull(s: float, x: Any) -> float:
        return float(np.interp(s, t, torque) - 4.0 * np.sin(x[0]))

    modes = {
        "off": Location(lambda s, x: [x[1], pull(s, x) / 0.5], {"on": lambda s, x: x[0] - 0.4}),
        "on": Location(
            lambda s, x: [x[1], (pull(s, x) - 300.0 * (x[0] - 0.4)) / 0.5],
            {"off": lambda s, x: 0.4 - x[0]},
        ),
    }
    return simulated(modes, "off", [-2.0, 0.0], t)


def bounced(t: Any, torque: Any, accuracy: float) -> Trajectory:
    return simulate_modes(
        pendulum(), t, (), {"T": torque}, events=[STOP], start=SWING, hold="linear",
        accuracy=accuracy,
    )  # fmt: skip


def test_a_pendulum_hits_a_stop_as_scipy_says() -> None:
    t = np.linspace(0.0, 3.0, 76)
    torque = 0.3 * np.sin(2.0 * t)
    truth, begun = swung(t, torque)
    assert len(begun) == 4
    late = []
    for accuracy in (1e-3, 1e-5, 1e-7, 1e-9):
        run = bounced(t, torque, accuracy)
        assert [m for _, m in told(run)] == [m for _, m in begun]
        late.append(max(abs(a - b) for (a, _), (b, _) in zip(told(run), begun, strict=True)))
        assert late[-1] < 0.3 * accuracy + 1e-8
    np.testing.assert_allclose(run["phi"], truth[:, 0], rtol=0, atol=1e-7)
    np.testing.assert_allclose(run["w"], truth[:, 1], rtol=0, atol=1e-6)
    slope = np.polyfit(np.log([1e-3, 1e-5, 1e-7]), np.log(late[:3]), 1)[0]
    assert 0.6 < slope < 1.5  # times come with the accuracy that is asked for


def test_a_reading_that_is_rounded_settles_as_it_is_before() -> None:
    t = np.linspace(0.0, 3.0, 1001)
    free = Guard("stop", on=When(displacement("gravity1"), above=0.4), off=STOP.off)
    coarse = pendulum().with_element("phi", resolution=1e-4)
    torque = {"T": 0.3 * np.sin(2.0 * t)}
    run = simulate_modes(
        coarse, t, (), torque, events=[free], start=SWING, hold="linear", accuracy=1e-5
    )
    plain = bounced(t, torque["T"], 1e-5)
    assert run.steps_per_sample == plain.steps_per_sample
    assert_same_events(told(run), told(plain), 1e-9)
    assert 4e-5 < np.abs(run["phi"] - plain["phi"]).max() <= 5.1e-5


def test_a_lossless_bounce_keeps_its_energy() -> None:
    t = np.linspace(0.0, 6.0, 301)
    run = bounced(t, 0 * t, 1e-9)
    assert len(run.events) == 6
    pad = np.maximum(run["phi"] - 0.4, 0.0)
    energy = 0.25 * run["w"] ** 2 + 4.0 * (1 - np.cos(run["phi"])) + 150.0 * pad**2
    np.testing.assert_allclose(energy, energy[0], rtol=1e-6)


def test_a_pendulum_sticks_at_the_stop_where_its_friction_holds_it() -> None:
    t = np.linspace(0.0, 12.0, 301)
    graph = pendulum(Coulomb(1.5, unit="N*m"))
    run = simulate_modes(graph, t, (), {"T": 0 * t}, events=[STOP], start=SWING)
    assert [m for _, m in told(run)][:2] == ["on", "off"]
    assert abs(np.sin(run["phi"][-1])) < 1.5 / 4.0
    assert (run["w"][-100:] == 0.0).all()
    assert np.ptp(run["phi"][-100:]) == 0.0


def test_a_height_is_watched_that_is_no_linear_signal() -> None:
    """A pendulum is let go of by its brake where its height passes a level."""
    t = np.linspace(0.0, 1.0, 41)
    angle = displacement("gravity1")
    high = Guard("stop", on=When(0.5 * (1 - sp.cos(angle)), below=0.1))
    run = simulate_modes(pendulum(), t, (), {"T": 0 * t}, events=[high], start=SWING, accuracy=1e-8)
    plain = simulate(in_mode(pendulum()), t, {"T": 0 * t}, x0=SWING, accuracy=1e-8)
    level = float(np.arccos(0.8))
    at = float(np.interp(-level, plain["phi"], t))
    assert [e.on for e in run.events] == [True]
    assert run.events[0].time == pytest.approx(at, abs=2e-3)
    before = t < run.events[0].time
    assert run["phi"][before][-1] < -level < run["phi"][~before][0]


def test_a_square_is_watched_in_a_linear_model() -> None:
    """The mode that has it takes the general step."""
    t = np.linspace(0.0, 1.0, 101)
    guard = Guard("heater", on=When("T", below=19.0), off=When(effort("room") ** 2, above=441.0))
    drive = {"T_h": 60.0 + 0 * t}
    run = simulate_modes(oven(), t, (), drive, events=[guard], accuracy=1e-8)
    linear = simulate_modes(oven(), t, (), drive, events=[THERMOSTAT])
    assert len(linear.events) > 4
    assert_same_events(told(run), told(linear), 1e-7)


# -- linear models through the general step ---------------------------------------------------
def hopper() -> BondGraph:
    """A ball over a springy floor."""
    with BondGraph("hopper") as g:
        ball, contact = One("ball"), X0("contact", on=False)
        MSe("weight", -9.81, unit="N") >> ball >> I("m", 1.0, unit="kg")
        ball >> contact >> C("pad", stiffness=1e4, unit="N/m")
        ball >> Dq("x", unit="m")
        ball >> Df("v", unit="m/s")
    return g


RISING = np.linspace(0.0, 0.1, 201)
CASES: dict[str, tuple[BondGraph, Any, Mapping[str, Any], Guard, Mapping[str, float], str]] = {
    "rectifier": (
        rectifier(), RISING, {"V": 10.0 * np.sin(314.0 * RISING)}, diode("D"), {}, "linear",
    ),
    "held": (
        rectifier(), RISING, {"V": 10.0 * np.sin(314.0 * RISING)}, diode("D"), {}, "hold",
    ),
    "oven": (oven(), 20 * RISING, {"T_h": 60.0 + 0 * RISING}, THERMOSTAT, {}, "hold"),
    "hopper": (
        hopper(), 10 * RISING, {},
        Guard("contact", on=When("x", below=0.0), off=When(effort("contact"), above=0.0)),
        {"p_m": 2.0, "q_x": 0.0}, "hold",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", list(CASES))
def test_a_linear_model_switches_alike_in_either_step(
    name: str, general_step: Callable[[], None]
) -> None:
    graph, t, commands, guard, start, hold = CASES[name]

    def run(accuracy: float) -> Trajectory:
        return simulate_modes(
            graph, t, (), commands, events=[guard], start=start, hold=hold, accuracy=accuracy
        )

    exact = run(1e-4)
    general_step()
    loose, tight = run(1e-4), run(1e-9)
    assert len(exact.events) >= 4
    assert tight.steps_per_sample > exact.steps_per_sample
    assert_same_events(told(loose), told(exact), 1e-4 * t[-1])
    assert_same_events(told(tight), told(exact), 1e-8 * t[-1])
    for n, y in exact.outputs.items():
        np.testing.assert_allclose(tight[n], y, rtol=0, atol=1e-6 * np.ptp(y))


value = st.floats(0.1, 10.0)


@settings(max_examples=4, deadline=None)
@given(value, value, value, value, st.booleans(), st.integers(0, 2**31), st.booleans())
def test_a_diode_blocks_or_conducts_in_any_circuit(
    source: float, load: float, store: float, turn: float, coil: bool, seed: int, held: bool
) -> None:
    """A coil with a modulated resistance: no mode that conducts has an exact step."""
    g = diode_circuit(source, load, store, coil=coil, warming=True)
    blocks_or_conducts(g, turn, seed, held=held)


def test_what_a_held_input_makes_for_less_than_a_sample_is_seen() -> None:
    """A voltage behind a capacitor is gone again at the next sample."""
    with BondGraph("high") as g:
        loop, more = One("loop"), X0("more", on=False)
        Se("V", unit="V") >> loop >> C("c", 0.01, unit="F")
        loop >> R("r", 1.0, unit="ohm")
        MSe("warm", -0.1 * sp.sin(TIME) ** 2 * flow("loop")) >> loop
        loop >> more >> R("rest", 1.0, unit="ohm")
        loop >> Df("i")
    t = np.linspace(0.0, 1.0, 11)
    jump = {"V": np.where(t < 0.45, 0.0, 1.0)}
    guard = Guard("more", on=When(effort("r"), above=0.5))
    run = simulate_modes(g, t, (), jump, events=[guard], hold="hold")
    assert [(e.junction, e.on) for e in run.events] == [("more", True)]
    assert run.events[0].time == pytest.approx(0.5, abs=1e-12)


# -- other graphs -----------------------------------------------------------------------------
def crank() -> BondGraph:
    """A crank whose slide, of a mass that depends on its flywheel, meets a stop."""
    with BondGraph("crank") as g:
        turn, slide, stop = One("turn"), One("slide"), X0("stop", on=False)
        Se("F") >> turn >> I("J", 0.1)
        turn >> C("phi", stiffness=1.0)
        turn >> MTF("crank", ratio=-0.5 * sp.sin(displacement("phi"))) >> slide
        slide >> I("m", 1.0)
        slide >> stop >> C("pad", stiffness=500.0)
        turn >> Df("w")
        slide >> Dq("x")
    return g


def test_a_crank_meets_a_stop_as_scipy_says() -> None:
    t = np.linspace(0.0, 4.0, 101)
    torque = 2.0 * np.sin(3.0 * t)
    meet = Guard("stop", on=When("x", below=-0.3), off=When(effort("stop"), above=0.0))
    run = simulate_modes(
        crank(), t, (), {"F": torque}, events=[meet], start={"q_phi": 1.0, "p_J": 0.1},
        hold="linear", accuracy=1e-8,
    )  # fmt: skip

    def way(phi: float) -> float:
        return float(0.5 * (np.cos(phi) - np.cos(1.0)))

    def rates(stiff: float) -> Any:
        def change(s: float, x: Any) -> Any:
            phi, w = x
            arm, bend = -0.5 * np.sin(phi), -0.5 * np.cos(phi)
            force = stiff * (way(phi) + 0.3)
            pull = np.interp(s, t, torque) - phi - arm * force - arm * bend * w**2
            return [w, pull / (0.1 + arm**2)]

        return change

    modes = {
        "off": Location(rates(0.0), {"on": lambda s, x: -0.3 - way(x[0])}),
        "on": Location(rates(500.0), {"off": lambda s, x: way(x[0]) + 0.3}),
    }
    truth, begun = simulated(modes, "off", [1.0, 1.0], t)
    assert len(begun) >= 4
    assert_same_events(told(run), begun, 1e-5)
    np.testing.assert_allclose(run["w"], truth[:, 1], rtol=0, atol=1e-4)


def test_a_converter_with_a_coil_that_saturates_gives_what_it_takes() -> None:
    period, n = 1e-4, 8
    flux = sp.Symbol("p1", real=True)
    with BondGraph("boost") as g:
        s, d = X0("S", on=False), X1("D", on=True)
        coil, out = One("coil"), Zero("out")
        Se("V") >> coil >> IField("L", energy=flux**2 / 2e-3 + 2e8 * flux**4, ports=1)
        coil >> R("R_L", 0.05)
        coil >> s >> d >> out >> C("C_o", 1e-4)
        d >> R("R_D", 0.02)
        out >> R("load", 50.0)
        coil >> Df("i")
        out >> De("u")
    t = np.arange(20 * n + 1) * period / n
    plan = [
        (k * period + part, {"S": on})
        for k in range(20)
        for part, on in ((0.0, False), (0.4 * period, True))
    ]
    run = simulate_modes(g, t, plan, {"V": 12 + 0 * t}, events=[diode("D")], accuracy=1e-7)

    def current(x: Any) -> float:
        return float(x[0] / 1e-3 + 8e8 * x[0] ** 3)

    def rates(feeds: bool, path: bool) -> Any:
        def change(s: float, x: Any) -> Any:
            i = current(x)
            back = (x[1] + 0.02 * i) * path
            return [12.0 - 0.05 * i - back, (i * path - x[1] / 50.0) / 1e-4]

        return change

    modes = {
        "short": Location(rates(False, False)),
        "feed": Location(rates(True, True), {"dry": lambda s, x: -x[0]}),
        "dry": Location(lambda s, x: [0.0, -x[1] / 5e-3], {"feed": lambda s, x: 12.0 - x[1]}),
    }
    truth, begun = simulated(
        modes, "feed", [0.0, 0.0], t, {at: "feed" if c["S"] else "short" for at, c in plan}
    )
    dry = [at for at, mode in begun if mode == "dry"]
    assert len(dry) > 10
    found = [e.time for e in run.events if not e.on and 0.41 < e.time / period % 1 < 0.99]
    np.testing.assert_allclose(found, dry, atol=1e-5 * period)
    np.testing.assert_allclose(run["u"], truth[:, 1], rtol=0, atol=1e-5 * np.ptp(truth[:, 1]))


def test_memory_and_time_go_on_through_the_modes() -> None:
    law = Hysteretic(PrandtlIshlinskii((0.0, 0.1, 0.2), (1.0, 0.3, 0.4)))
    with BondGraph("g") as g:
        body, brake = One("body"), X0("brake", on=False)
        Se("F") >> body >> I("m", 1.0)
        MSe("push", sp.sin(3 * TIME) * effort("k")) >> body
        body >> R("b", 0.5)
        body >> C("k", law=law)
        body >> brake >> R("pad", 2.0)
        body >> Dq("x")
        body >> Df("v")
    t = 5.0 + np.linspace(0.0, 8.0, 201)  # the time of the model counts from the first sample
    force = {"F": np.sin(2 * t) + 0.3 * np.sin(7 * t)}
    plain = simulate(in_mode(g), t, force, accuracy=1e-5)
    same = simulate_modes(g, t, [(6.123, {}), (7.0, {"brake": False})], force, accuracy=1e-5)
    np.testing.assert_allclose(same["x"], plain["x"], rtol=0, atol=2e-3 * np.ptp(plain["x"]))
    guard = Guard("brake", on=When(flow("body"), above=0.2), off=When(flow("body"), below=0.1))
    run = simulate_modes(g, t, (), force, events=[guard], accuracy=1e-5)
    plan = [(e.time, {e.junction: e.on}) for e in run.events]
    again = simulate_modes(g, t, plan, force, accuracy=1e-5)
    assert len(plan) > 2
    np.testing.assert_allclose(run["v"], again["v"], rtol=0, atol=1e-3 * np.ptp(run["v"]))


# -- what cannot be ---------------------------------------------------------------------------
def runaway() -> BondGraph:
    """A body that a spring drives away ever faster, up to a stop."""
    with BondGraph("runaway") as g:
        body, stop = One("body"), X0("stop", on=False)
        body >> I("m", 1.0)
        MSe("push", 5 * displacement("k") ** 3) >> body
        body >> C("k", stiffness=1.0)
        body >> stop >> C("pad", stiffness=5000.0)
        body >> Dq("x")
    return g


@pytest.mark.filterwarnings("ignore:.*sub-steps a sample")
def test_a_stop_is_met_before_a_motion_has_no_end() -> None:
    """Within the same run of samples the old mode would leave all bounds."""
    t = np.linspace(0.0, 2.0, 81)
    begun = {"q_k": 1.0, "p_m": 0.0}
    with pytest.raises(BondsightError, match=r"runaway: Newton's method does not converge near 0"):
        simulate_modes(runaway(), t, (), start=begun)
    stop = Guard("stop", on=When("x", above=2.0))
    run = simulate_modes(runaway(), t, (), start=begun, events=[stop])
    assert [e.on for e in run.events] == [True]
    assert run["x"].max() < 2.5


def test_a_mode_without_equations_says_so() -> None:
    with BondGraph("open") as g:
        a, first, second = One("a"), X1("A"), X1("B")
        Se("V") >> a >> R("r", 0.1)
        MSe("x", sp.sin(TIME) * effort("r")) >> a
        a >> first >> Zero("node") >> second >> C("c", 1.0)
        second >> R("load", 1.0)
    t = np.linspace(0.0, 1.0, 11)
    with pytest.raises(GraphError, match=r"^mode A off, B off: open: causal conflict at bond") as e:
        simulate_modes(g, t, [(0.5, {"A": False, "B": False})], {"V": 1 + 0 * t})
    assert "\n" not in str(e.value)


def test_an_impulse_between_stores_of_a_general_mode_is_refused() -> None:
    """A mass that a bent lever would have to take along at once."""
    with BondGraph("lever") as g:
        turn, slide, clutch = One("turn"), One("slide"), X0("clutch", on=False)
        Se("F") >> turn >> I("J", 0.1)
        turn >> C("phi", stiffness=1.0)
        turn >> MTF("crank", ratio=1 + displacement("phi")) >> clutch >> slide >> I("m", 1.0)
        turn >> Df("w")
    t = np.linspace(0.0, 1.0, 51)
    close = [(0.5, {"clutch": True})]
    with pytest.raises(GraphError, match=r"clutch on at 0.5 s needs an impulse: the store \w+ "):
        simulate_modes(g, t, close, {"F": 1 + 0 * t}, start={"q_phi": 0.0, "p_J": 0.0, "p_m": 0.0})


def test_a_start_is_asked_for_where_nothing_rests() -> None:
    with BondGraph("restless") as g:
        body, stop = One("body"), X0("stop", on=False)
        body >> I("m", 1.0)
        MSe("push", 1.0 + displacement("k") ** 2) >> body
        body >> C("k", 1.0)
        body >> stop >> R("pad", 1.0)
        body >> Df("v")
    t = np.linspace(0.0, 0.5, 51)
    with pytest.raises(GraphError, match=r"give all states of the first mode in start= \(p_m, q_k"):
        simulate_modes(g, t, ())
    run = simulate_modes(g, t, (), start={"p_m": 0.0, "q_k": 0.0})
    assert run["v"][-1] > 0.4


def test_a_rate_of_what_is_held_is_refused() -> None:
    with BondGraph("fed") as g:
        d, node = X1("D", on=False), Zero("node")
        Se("V") >> d >> node >> C("c", 1.0)
        MSe("warm", sp.sin(TIME) * effort("node")) >> (side := One("side")) >> R("r", 1.0)
        node >> side
        node >> De("u")
    t = np.linspace(0.0, 1.0, 21)
    close = [(0.5, {"D": True})]
    with pytest.raises(UnusableInput, match=r"fed: the equations need d_V, but .* hold='linear'"):
        simulate_modes(g, t, close, {"V": 0 * t}, hold="hold")
    ramp = np.maximum(t - 0.5, 0.0)
    run = simulate_modes(g, t, close, {"V": ramp}, hold="linear")
    np.testing.assert_allclose(run["u"], ramp, atol=1e-12)
