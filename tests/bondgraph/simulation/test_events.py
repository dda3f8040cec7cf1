"""Junctions that switch by the state, against closed forms and SciPy's event location."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph import (
    BondGraph,
    C,
    De,
    Df,
    Dq,
    I,
    MSe,
    MSf,
    One,
    R,
    Se,
    Zero,
    displacement,
    effort,
)
from bondgraph.graph.elements import X0, X1
from bondgraph.simulation.modes import states
from bondgraph.simulation.modes.guards import Guard, When
from bondgraph.simulation.modes.run import simulate_modes
from tests.bondgraph.simulation.hybrid import Location, simulated
from tests.bondgraph.simulation.switched import (
    assert_same_events,
    diode,
    oven,
    rectifier,
    told,
)


# -- circuits --------------------------------------------------------------------------------
@pytest.mark.parametrize("count", [201, 1001])
def test_a_half_wave_rectifier_conducts_as_scipy_says(count: int) -> None:
    t = np.linspace(0.0, 0.08, count)
    v = 10.0 * np.sin(2 * np.pi * 50.0 * t)

    def ahead(s: float, x: Any) -> float:
        return float(np.interp(s, t, v) - x[0])

    modes = {
        "off": Location(lambda s, x: [-x[0] / 0.1], {"on": ahead}),
        "on": Location(
            lambda s, x: [ahead(s, x) / 5e-4 - x[0] / 0.1], {"off": lambda s, x: -ahead(s, x)}
        ),
    }
    truth, begun = simulated(modes, "off", [0.0], t)
    run = simulate_modes(rectifier(), t, (), {"V": v}, events=[diode("D")], hold="linear")
    np.testing.assert_allclose(run["u"], truth[:, 0], rtol=0, atol=1e-9)
    assert len(begun) > 6
    assert_same_events(told(run), begun, 1e-11)
    assert run["i"].min() >= -1e-12
    assert repr(run).endswith(f"u, i, {len(begun)} events)")


def buck() -> BondGraph:
    """A converter that steps down: its coil runs dry at a light load."""
    with BondGraph("buck") as g:
        s, d = X1("S", on=False), X1("D", on=False)
        a, coil, out = Zero("a"), One("coil"), Zero("out")
        Se("V", unit="V") >> s >> R("R_S", 0.01, unit="ohm")
        s >> a
        MSe("ground", 0.0, unit="V") >> d >> a
        d >> R("R_D", 0.02, unit="ohm")
        a >> coil >> I("L", 1e-4, unit="H")
        coil >> out >> C("C_o", 1e-4, unit="F")
        out >> R("load", 200.0, unit="ohm")
        coil >> Df("i", unit="A")
        out >> De("u", unit="V")
    return g


PERIOD, DUTY = 1e-4, 0.3


def pulses(count: int) -> list[tuple[float, dict[str, bool]]]:
    return [
        (k * PERIOD + part * PERIOD, {"S": on})
        for k in range(count)
        for part, on in ((0.0, True), (DUTY, False))
    ]


@pytest.mark.parametrize("samples", [8, 40])  # a period
def test_a_converter_runs_dry_until_the_next_pulse(samples: int) -> None:
    t = np.arange(20 * samples + 1) * (PERIOD / samples)
    load = 200.0

    def rates(drive: float, resistance: float, coil: float) -> Any:
        return lambda s, x: [
            coil * (drive - resistance * x[0] - x[1]) / 1e-4, (x[0] - x[1] / load) / 1e-4,
        ]  # fmt: skip

    modes = {
        "S": Location(rates(12.0, 0.01, 1.0)),
        "D": Location(rates(0.0, 0.02, 1.0), {"dry": lambda s, x: -x[0]}),
        "dry": Location(rates(0.0, 0.0, 0.0)),
    }
    plan = pulses(20)
    truth, begun = simulated(
        modes, "S", [0.0, 0.0], t, {at: "S" if c["S"] else "D" for at, c in plan}
    )
    run = simulate_modes(buck(), t, plan, {"V": np.full(t.size, 12.0)}, events=[diode("D")])
    np.testing.assert_allclose(run["u"], truth[:, 1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(run["i"], truth[:, 0], rtol=0, atol=1e-9)
    dry = [at for at, mode in begun if mode == "dry"]
    assert len(dry) > 15
    found = [e.time for e in run.events if not e.on]
    np.testing.assert_allclose([f for f in found if f % PERIOD > 1e-9 * PERIOD], dry, atol=1e-12)
    assert (run["i"] == 0.0).sum() > len(dry)  # exactly: the coil is off the circuit


def test_a_mode_is_compiled_once_whatever_switches(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    first = states.Mode.__init__

    def counted(self: Any, *given: Any) -> None:
        first(self, *given)
        made.append(self.text)

    monkeypatch.setattr(states.Mode, "__init__", counted)
    t = np.arange(1001) * (PERIOD / 20)
    run = simulate_modes(buck(), t, pulses(50), {"V": np.full(t.size, 12.0)}, events=[diode("D")])
    assert len(run.events) > 80
    assert len(made) == len(set(made)) <= 4


# -- two levels ------------------------------------------------------------------------------


@pytest.mark.parametrize("signal", ["T", effort("room"), displacement("C_r")])
def test_a_thermostat_has_the_periods_of_the_formula(signal: Any) -> None:
    t = np.linspace(0.0, 3.0, 301)
    guard = Guard("heater", on=When(signal, below="low"), off=When(signal, above="high"))
    run = simulate_modes(oven(), t, (), {"T_h": 0 * t + 60.0}, events=[guard], start={"q_C_r": 0.0})
    heated = 0.5 * np.log(30.0 / 9.0)  # towards 30 with half the time constant
    cooling, heating = np.log(21.0 / 19.0), 0.5 * np.log(11.0 / 9.0)
    expected = [(0.0, "on"), (heated, "off")]
    while expected[-1][0] < 3.0:
        at, mode = expected[-1]
        expected.append((at + cooling, "on") if mode == "off" else (at + heating, "off"))
    assert len(expected) > 20
    assert_same_events(told(run), expected[:-1], 1e-12)
    late = run["T"][t > heated]
    assert late.min() >= 19.0 - 1e-9
    assert late.max() <= 21.0 + 1e-9
    np.testing.assert_allclose(run["T"][:60], 30 * (1 - np.exp(-2 * t[:60])), atol=1e-9)


def test_levels_follow_the_parameters_that_they_name() -> None:
    t = np.linspace(0.0, 1.0, 101)
    drive = {"T_h": 0 * t + 60.0}
    g = oven()
    high = g.parameters["high"].symbol
    guard = Guard("heater", on=When("T", below=g.parameters["low"].symbol),
                  off=When("T", above=high / 2 + 3.0))  # fmt: skip
    run = simulate_modes(g, t, (), drive, {"high": 40.0, "loss": 1.0}, events=[guard])
    assert run.events[1].time == pytest.approx(0.5 * np.log(30.0 / 7.0), abs=1e-12)


def test_a_relief_valve_opens_and_closes_at_its_pressures() -> None:
    with BondGraph("tank") as g:
        tank, valve = Zero("tank"), X1("valve", on=False)
        MSf("pump", 1e-4, unit="m3/s") >> tank >> C("volume", 1e-9, unit="m3/Pa")
        tank >> valve >> R("seat", 2e9, unit="Pa*s/m3")
        tank >> De("p", unit="Pa")
        valve >> Df("relieved", unit="m3/s")
    guard = Guard(
        "valve", on=When(effort("tank"), above=5e5), off=When(effort("valve>seat"), below=3e5)
    )
    t = np.linspace(0.0, 50.0, 501)
    run = simulate_modes(g, t, (), events=[guard], start={"q_volume": 0.0})
    fall = 2.0 * np.log((5e5 - 2e5) / (3e5 - 2e5))  # towards pump * seat
    expected = [(5.0, "on")]
    while expected[-1][0] < 50.0:
        at, mode = expected[-1]
        expected.append((at + fall, "off") if mode == "on" else (at + 2.0, "on"))
    assert_same_events(told(run), expected[:-1], 1e-11)
    assert run["p"].max() <= 5e5 * (1 + 1e-9)
    assert (run["relieved"] > 0).sum() > 100


# -- contact ---------------------------------------------------------------------------------
def hopper(damping: float | None) -> BondGraph:
    """A ball over a springy floor; the contact passes a force while it is on."""
    with BondGraph("hopper") as g:
        ball, contact, floor = One("ball"), X0("contact", on=False), One("floor")
        MSe("weight", -9.81, unit="N") >> ball >> I("m", 1.0, unit="kg")
        ball >> contact >> floor >> C("pad", stiffness=1e4, unit="N/m")
        if damping:
            floor >> R("loss", damping, unit="N*s/m")
        ball >> Dq("x", unit="m")
        ball >> Df("v", unit="m/s")
    return g


BOUNCE = Guard("contact", on=When("x", below=0.0), off=When(effort("contact"), above=0.0))


def test_an_elastic_ball_comes_back_as_high() -> None:
    t = np.linspace(0.0, 3.0, 601)
    run = simulate_modes(hopper(None), t, (), events=[BOUNCE], start={"p_m": 2.0, "q_x": 0.0})
    half = 2.0 / 9.81
    w = 100.0
    # m x'' = -9.81 - k x from x = 0 at -2 m/s on, until the force of the pad is zero again
    inside = 2 * (np.pi - np.arctan(2.0 * w / 9.81)) / w
    expected, at = [], 0.0
    for _ in range(20):
        expected += [(at + 2 * half, "on"), (at + 2 * half + inside, "off")]
        at = expected[-1][0]
    expected = [(a, m) for a, m in expected if a < 3.0]
    assert len(expected) > 10
    assert_same_events(told(run), expected, 1e-10)
    energy = 0.5 * run["v"] ** 2 + 9.81 * run["x"] + 0.5e4 * np.minimum(run["x"], 0.0) ** 2
    np.testing.assert_allclose(energy, 2.0, rtol=1e-9)


def test_a_mass_hits_a_damped_stop_as_scipy_says() -> None:
    """The pad goes on to creep back while nothing touches it; it may be met before it has."""
    with BondGraph("stop") as g:
        body, contact, pad = One("body"), X0("contact", on=False), One("pad")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> C("k", stiffness=4.0, unit="N/m")
        body >> contact >> pad >> C("k_c", stiffness=400.0, unit="N/m")
        pad >> R("b_c", 8.0, unit="N*s/m")
        body >> Df("v", unit="m/s")
    gap = 0.3
    stop = Guard(
        "contact",
        on=When(displacement("k") - displacement("k_c"), above=gap),
        off=When(effort("contact"), below=0.0),
    )
    t = np.linspace(0.0, 12.0, 601)
    force = 2.0 * np.sin(2.3 * t)

    def f(s: float) -> float:
        return float(np.interp(s, t, force))

    def touching(x: Any) -> float:
        return float(400.0 * x[2] + 8.0 * x[0])

    modes = {
        "off": Location(
            lambda s, x: [f(s) - 4 * x[1], x[0], -50.0 * x[2]],
            {"on": lambda s, x: x[1] - x[2] - gap},
        ),
        "on": Location(
            lambda s, x: [f(s) - 4 * x[1] - touching(x), x[0], x[0]],
            {"off": lambda s, x: -touching(x)},
        ),
    }
    truth, begun = simulated(modes, "off", [0.0, 0.0, 0.0], t)
    run = simulate_modes(g, t, (), {"F": force}, events=[stop], hold="linear")
    assert len(begun) > 6
    assert_same_events(told(run), begun, 1e-9)
    np.testing.assert_allclose(run["v"], truth[:, 0], rtol=0, atol=1e-9)
