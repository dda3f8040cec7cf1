"""A step and a pulse begin at rest, whatever integrates; a start is said where it is not that."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import (
    BondGraph,
    C,
    De,
    Df,
    Dq,
    I,
    One,
    R,
    Se,
    Sf,
    UnknownName,
    UnusableInput,
    Zero,
    impulse_response,
    simulate,
    step_response,
)
from bondgraph.energy.bond_power import observables
from bondgraph.energy.ledger import ledger
from bondgraph.graph.drives import Drive
from bondgraph.hysteresis import KelvinVoigtCreep
from bondgraph.laws import Hysteretic
from bondgraph.simulation.simulate import simulate_general

TIME = np.arange(1000) * 1e-3
ONES = {"F": np.ones(1000)}


def cart(**drive: object) -> BondGraph:
    """0.5 kg against 1 N s/m: half a second."""
    with BondGraph("cart") as g:
        if drive:
            g.parameter("tau", 0.01, "s", fixed=True)
        body = One("body")
        Se("F", unit="N", **drive) >> body >> I("m", 0.5, unit="kg")  # type: ignore[arg-type]
        body >> R("d", 1.0, unit="N*s/m")
        body >> Df("v", unit="m/s")
    return g


RISE = 1.0 - np.exp(-2.0 * TIME)


@pytest.mark.parametrize("run", [simulate, simulate_general])
def test_a_constant_input_is_a_step(run: object) -> None:
    assert run(cart(), TIME, ONES)["v"] == pytest.approx(RISE, abs=1e-4)  # type: ignore[operator]
    assert step_response(cart(), TIME, size=3.0)["v"] == pytest.approx(3.0 * RISE, abs=1e-4)
    settled = run(cart(), TIME, ONES, x0="rest")["v"]  # type: ignore[operator]
    assert settled == pytest.approx(np.ones(1000))


def test_a_pulse_of_one_newton_second_gives_one_over_the_mass() -> None:
    made = impulse_response(cart(), TIME)["v"]
    assert made[1:] == pytest.approx(2.0 * np.exp(-2.0 * (TIME[1:] - 0.5e-3)), rel=1e-6)


def test_a_late_drive_had_nothing_to_pass_before_the_first_sample() -> None:
    made = step_response(cart(drive=Drive(delay="tau")), TIME)["v"]
    assert made[:10] == pytest.approx(np.zeros(10), abs=1e-12)
    assert made[10:] == pytest.approx(RISE[:-10], abs=1e-3)


@pytest.mark.parametrize("samples", [10.37, 0.2])
def test_a_held_step_is_late_by_any_part_of_a_sample(samples: float) -> None:
    """Nothing before it arrives, no ringing after, and the impulse is right."""
    late = cart(drive=Drive(delay="tau")).with_values({"tau": samples * 1e-3})
    made = step_response(late, TIME)["v"]
    first = int(samples) + 1
    assert (made[:first] == 0.0).all()
    exact = 1.0 - np.exp(-2.0 * (TIME[first:] - samples * 1e-3))
    assert made[first:] == pytest.approx(exact, abs=1e-6)
    assert (np.diff(made, 2)[first:] < 0.0).all()


def test_inputs_are_held_as_by_a_converter() -> None:
    """Against the exact recursion of a first-order lag behind a hold."""
    u = np.random.default_rng(0).normal(size=200)
    run = simulate(cart(), TIME[:200], {"F": u})
    assert run.hold == "hold"
    v, fade = [0.0], np.exp(-2e-3)
    for force in u[:-1]:
        v.append(fade * v[-1] + (1.0 - fade) * force)
    assert run["v"] == pytest.approx(np.array(v), abs=1e-9)
    general = simulate_general(cart(), TIME[:200], {"F": u}, accuracy=1e-7)
    assert general["v"] == pytest.approx(np.array(v), abs=1e-5)


def test_the_ledger_knows_what_the_inputs_did() -> None:
    g = cart()
    for hold in (None, "linear"):
        run = simulate(g, TIME, {"F": np.cos(40 * TIME)}, hold=hold, observed=observables(g))
        assert ledger(g, run).relative_residual < 1e-5


def test_a_law_remembers_the_rest_before_the_step() -> None:
    """Creep on the input: a step has its prompt part at once, a rest under it the whole."""
    creep = KelvinVoigtCreep(gain=1.0, weights=(0.5,), times=(10.0,))
    with BondGraph("creep") as g:
        node = Zero("node")
        Sf("f") >> node >> R("r", law=Hysteretic(creep))
        node >> De("e")
    made = step_response(g, TIME)["e"]
    assert made == pytest.approx(1.0 + 0.5 * (1.0 - np.exp(-TIME / 10.0)), abs=1e-3)


def test_a_supply_that_was_always_on_is_said() -> None:
    """A tank at rest under its supply stays; from empty, it fills."""
    with BondGraph("tank") as g:
        tank = Zero("tank")
        Sf("q", unit="m^3/s") >> tank >> C("c", 1.0, unit="m^3/Pa")
        tank >> R("r", 2.0, unit="Pa*s/m^3")
        tank >> De("p", unit="Pa")
    assert simulate(g, TIME, {"q": np.ones(1000)}, x0="rest")["p"] == pytest.approx(2 * ONES["F"])
    assert simulate(g, TIME, {"q": np.ones(1000)})["p"][0] == pytest.approx(0.0)


def test_refusals() -> None:
    with BondGraph("two") as two:
        body = One("body")
        Se("F_1") >> body >> I("m", 1.0)
        Se("F_2") >> body >> Dq("x")
    with pytest.raises(UnusableInput, match=r"two has 2 sources \(F_1, F_2\)"):
        step_response(two, TIME)
    with pytest.raises(UnknownName, match="F_1"):
        step_response(two, TIME, "F1")
    assert step_response(two, TIME, "F_2")["x"][-1] == pytest.approx(0.5 * 0.999**2)
    with pytest.raises(UnknownName, match="rest"):
        simulate(cart(), TIME, ONES, x0="resting")
