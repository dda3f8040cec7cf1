"""The ledger closes to the order of its rule; the equations keep power, element by element."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from actuators.stack.bond_graph import stack_bond_graph
from bondgraph import BondGraph, C, GraphError, I, One, R, Se, Sf, Trajectory, UnusableInput
from bondgraph.energy.accounts import Ledger
from bondgraph.energy.bond_power import motion, observables
from bondgraph.energy.ledger import ledger
from bondgraph.equations.codegen import program
from bondgraph.equations.derivation import equations
from bondgraph.graph.elements import RE, RS, Zero
from bondgraph.hysteresis import MaxwellResistiveCapacitor, PrandtlIshlinskii
from bondgraph.laws import Coulomb, Hysteretic, Polynomial, Sliding, StopSum, TableLaw
from tests.bondgraph.energy.energy_models import coupled, crank, plate, rlc
from tests.bondgraph.energy.power_balance import power_balance
from tests.properties.test_random_graphs import random_graph
from tests.settled import simulate
from tests.spring import spring

SLIPS = MaxwellResistiveCapacitor((1.3e9, 0.6e9), (0.4e3, 1.1e3))


def account(g: BondGraph, n: int, end: float, drive: Any, **options: Any) -> Ledger:
    time = np.linspace(0.0, end, n)
    (source,) = g.of_type(Se)
    run = simulate(g, time, {source.name: drive(time)}, observed=observables(g), **options)
    return ledger(g, run)


def integrated(g: BondGraph, time: Any, drive: Any, x0: Any, values: Any = None) -> Trajectory:
    """A trajectory of the executable form by an integrator that knows nothing of energy."""
    p = program(g)
    numbers = [(values or {}).get(n, v) for n, v in zip(p.parameters, p.nominal, strict=True)]

    def rhs(t: float, x: Any) -> Any:
        return p.rhs(t, x, [], [drive(t)], numbers, [], 0.0)[0].full().ravel()

    run = solve_ivp(rhs, (time[0], time[-1]), x0, t_eval=time, rtol=1e-11, atol=1e-13)
    found = dict(zip(p.states, run.y, strict=True))
    return Trajectory(g.name, time, {**found, p.inputs[0]: drive(time)})


def close(a: Any, b: Any, **tolerance: Any) -> None:
    np.testing.assert_allclose(a, b, **tolerance)


def order(residuals: list[float]) -> float:
    return float(np.log2(residuals[0] / residuals[-1]) / (len(residuals) - 1))


@pytest.mark.parametrize("model", [rlc, coupled, stack_bond_graph])
def test_the_residual_falls_with_the_fourth_power(model: Any) -> None:
    g = model()
    end, size = (4e-3, 60.0) if model is stack_bond_graph else (2.0, 1.0)
    found = [account(g, n, end, lambda t: size * np.sin(6.0 * t / end)) for n in (401, 801, 1601)]
    residuals = [a.relative_residual for a in found]
    assert order(residuals) == pytest.approx(4.0, abs=0.25), residuals
    assert residuals[-1] < 2e-6
    assert all(a.closes for a in found)
    assert max(a.imbalance for a in found) < 1e-13
    assert found[-1].quadrature > 0.1 * residuals[-1]


def test_energies_of_a_resonator_are_those_of_pencil_and_paper() -> None:
    g = rlc()
    a = account(g, 801, 3.0, lambda t: np.sin(2.0 * t))
    run = simulate(g, a.time, {"V": np.sin(2.0 * a.time)}, observed=("p_L", "q_C_1", "f_loop"))
    close(a["L"].stored, run["p_L"] ** 2 / (2 * 0.5), atol=1e-12)
    close(a["C_1"].stored, run["q_C_1"] ** 2 / (2 * 0.1), atol=1e-12)
    np.testing.assert_allclose(a.bond("loop>R_1").power, 0.4 * run["f_loop"] ** 2, atol=1e-12)
    assert a["R_1"].lost[-1] == pytest.approx(a.supplied[-1] - a.stored[-1], rel=1e-7)
    assert a.rows()[0][0] == "V"
    assert "sum" in str(a)
    assert "<table>" in a._repr_html_()
    assert "rlc" in repr(a)


def test_a_dependent_inertia_holds_its_share() -> None:
    a = account(coupled(), 401, 2.0, lambda t: np.sin(3.0 * t))
    speed = a.bond("a>m_1").flow
    close(a["m_2"].stored, 0.5 * 1.5 * (3.0 * speed) ** 2, atol=1e-12)


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize("dependent", [True, False])
def test_a_crank_from_another_integrator(dependent: bool) -> None:
    g = crank(dependent)
    time = np.linspace(0.0, 3.0, 1201)
    run = integrated(g, time, lambda t: 2.0 + np.sin(4.0 * t), [0.0, 0.5])
    found = [
        ledger(
            g,
            Trajectory("crank", time[::k], {n: v[::k] for n, v in run.outputs.items()}),
            hold="band-limited",
            accuracy=1e-10,
        )
        for k in (4, 2, 1)
    ]
    residuals = [a.relative_residual for a in found]
    assert order(residuals) > 3.5, residuals
    assert residuals[-1] < 1e-6
    assert max(a.imbalance for a in found) < 1e-12
    assert found[-1].lost[-1] > 0.03 * found[-1].throughput


def test_simulate_itself_keeps_the_energy_of_a_crank() -> None:
    a = account(crank(), 2001, 3.0, lambda t: 2.0 + np.sin(4.0 * t), accuracy=1e-6)
    assert a.closes
    assert a.relative_residual < 1e-4


def test_a_wrong_state_does_not_close() -> None:
    g = crank()
    time = np.linspace(0.0, 3.0, 601)
    run = integrated(g, time, lambda t: 2.0 + np.sin(4.0 * t), [0.0, 0.5])
    wrong = {**run.outputs, "p_J": run["p_J"] * 1.02}
    assert not ledger(g, Trajectory("crank", time, wrong), hold="band-limited").closes


def test_a_moving_plate_turns_electric_into_mechanical_work() -> None:
    g = plate()
    time = np.linspace(0.0, 0.05, 2001)
    run = integrated(g, time, lambda t: 50.0 * np.sin(300.0 * t), [2e-8, 1e-3, 0.0, 0.0])
    a = ledger(g, run, hold="band-limited", accuracy=1e-9)
    assert a.relative_residual < 1e-6
    exact = run["q_device1"] ** 2 * run["q_device2"] / (2 * 1e-9 * 1e-3)
    close(a["device"].stored, exact, rtol=1e-12)
    assert abs(a.bond("body>device").work).max() > 1e-3 * a.throughput


def hysteretic(law: Any) -> BondGraph:
    return stack_bond_graph(law, sensors=("x", "i"))


def test_a_hysteretic_stack_loses_energy_in_its_ceramics() -> None:
    g = hysteretic(Hysteretic(SLIPS))
    found = [
        account(g, n, 1e-2, lambda t: 60.0 * np.sin(400.0 * np.pi * t), accuracy=1e-6)
        for n in (501, 1001, 2001)
    ]
    residuals = [a.relative_residual for a in found]
    assert order(residuals) > 1.5, residuals
    assert residuals[-1] < 1e-5
    assert all(a.closes for a in found)
    lost = found[-1]["C_nl"].lost
    assert lost[-1] > 0.05 * found[-1].supplied[-1]
    assert (np.diff(lost) >= 0.0).all()


def test_slips_with_free_heights_and_with_numbers_agree() -> None:
    """The same stops as parameters of a law and as an operator: one energy."""
    heights, radii = SLIPS.stiffnesses, SLIPS.thresholds
    k = sum(heights)
    one, other = hysteretic(Hysteretic(SLIPS)), hysteretic(StopSum(radii))
    other = other.with_element("C_nl", value=1e12)  # next to no slope of its own
    values = {"h_1_C_nl": heights[0], "h_2_C_nl": heights[1]}
    time = np.linspace(0.0, 1e-2, 801)
    drive = {"V_in": 60.0 * np.sin(400.0 * np.pi * time)}
    first = ledger(one, simulate(one, time, drive, observed=observables(one), accuracy=1e-7))
    run = simulate(other, time, drive, values, observed=observables(other), accuracy=1e-7)
    second = ledger(other, run, parameters=values)
    assert k > 1e9
    scale = first["C_nl"].lost[-1]
    np.testing.assert_allclose(second["C_nl"].lost, first["C_nl"].lost, atol=1e-3 * scale)
    close(second["C_nl"].stored, first["C_nl"].stored, atol=1e-3 * scale)


@pytest.mark.parametrize("free", ["stiffnesses", "breakaways[1]"])
def test_free_numbers_of_an_operator_are_those_of_the_run(free: str) -> None:
    law = Hysteretic(MaxwellResistiveCapacitor((100.0, 200.0), (0.5, 3.0)), free=(free,))
    g = spring(0.1, 2.0, None, law)
    values = {p.name: 0.5 * p.value for p in law.parameters("k")}
    t = 2e-3 * np.arange(500)
    run = simulate(g, t, {"F": 3.0 * np.sin(2 * np.pi * t)}, values, observed=observables(g))
    assert ledger(g, run, parameters=values).closes
    assert not ledger(g, run).closes


def test_what_a_law_without_energy_does_stays_open() -> None:
    lags = PrandtlIshlinskii((0.0, 1e-9), (1.0e9, 0.5e9))
    a = account(hysteretic(Hysteretic(lags)), 801, 1e-2, lambda t: 60 * np.sin(400 * np.pi * t))
    assert a["C_nl"].stored is None
    assert a["C_nl"].open[-1] != 0.0
    assert "without an energy" in str(a)
    assert a.closes


def test_sliding_friction_holds_energy_in_its_bristles() -> None:
    with BondGraph("stage") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("bristles", 0.5, law=Sliding(MaxwellResistiveCapacitor((40.0,), (0.5,))))
    a = account(g, 2001, 4.0, lambda t: np.sin(5.0 * t), accuracy=1e-6)
    entry = a["bristles"]
    assert entry.stored is not None
    assert entry.stored.max() > 1e-4
    assert entry.stored.max() <= 0.5**2 / (2 * 40.0) * (1 + 1e-9)
    assert a.relative_residual < 1e-3
    assert a.closes


def test_sliding_plays_are_booked_by_their_work() -> None:
    """Plays lose at their input: the energy they hold there is no share of this work."""
    plays = PrandtlIshlinskii((0.0, 1e-3), (100.0, 500.0))
    with BondGraph("sliding") as g:
        Sf("v") >> One("body") >> R("plays", 0.0, law=Sliding(plays))
    time = np.linspace(0.0, 1.0, 201)
    drive = {"v": 2e-2 * np.pi * np.cos(2 * np.pi * time)}
    a = ledger(g, simulate(g, time, drive, observed=observables(g)))
    entry = a["plays"]
    assert entry.stored is None
    assert entry.note == "part may be held in its law"
    close(entry.lost, entry.work)
    assert a.closes


@pytest.mark.parametrize(
    ("law", "values", "limit"),
    [
        (Polynomial(orders=(2, 3)), {"a_2_C_1": 1.5, "a_3_C_1": 3.0}, 1e-7),
        (
            TableLaw((-1.0, -0.2, 0.3, 1.0), (-9.0, -1.0, 2.0, 12.0), flat=False, reference=10.0),
            {},
            1e-4,
        ),
        (
            TableLaw(
                (-1.0, -0.2, 0.3, 1.0), (-9.0, -1.0, 2.0, 12.0), "pchip", flat=False, reference=10.0
            ),
            {},
            1e-4,
        ),
    ],
)
def test_nonlinear_stores(law: Any, values: Any, limit: float) -> None:
    g = rlc().with_element("C_1", law=law)
    time = np.linspace(0.0, 4.0, 1601)
    drive = {"V": 1.5 * np.sin(3.0 * time)}
    run = simulate(g, time, drive, values, observed=observables(g), accuracy=1e-8)
    a = ledger(g, run, parameters=values)
    assert a.relative_residual < limit
    assert a["C_1"].stored is not None
    assert a["C_1"].stored.max() > 1e-3


def test_dry_friction_never_gives_energy() -> None:
    with BondGraph("slider") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("dry", 0.1, law=Coulomb())
    time = np.linspace(0.0, 4.0, 2001)
    values = {n: 0.3 for n in g.parameters if n.startswith("F_c")}
    assert values
    run = simulate(g, time, {"F": np.sin(3 * time)}, values, observed=observables(g), accuracy=1e-6)
    a = ledger(g, run, parameters=values)
    assert a.relative_residual < 2e-3
    assert a["dry"].power.min() > -1e-9


def test_inputs_held_between_samples() -> None:
    g = rlc()
    time = np.linspace(0.0, 2.0, 201)
    steps = {"V": np.sign(np.sin(7.0 * time))}
    run = simulate(g, time, steps, observed=observables(g), hold="hold")
    assert ledger(g, run, hold="hold").relative_residual < 1e-6
    assert ledger(g, run, hold="linear").relative_residual > 1e-4


def test_a_source_may_be_called_like_a_ramp() -> None:
    with BondGraph("rc") as g:
        loop = One("loop")
        Se("ramp_up") >> loop >> R("R_1", 1.0)
        loop >> C("C_1", 1.0)
    time = np.linspace(0.0, 2.0, 201)
    run = simulate(g, time, {"ramp_up": np.sin(time)}, observed=observables(g))
    assert ledger(g, run).closes


def test_parameters_of_the_run_are_those_of_the_ledger() -> None:
    g = rlc()
    time = np.linspace(0.0, 2.0, 401)
    run = simulate(g, time, {"V": np.sin(time)}, {"L": 0.8}, observed=observables(g))
    assert ledger(g, run, parameters={"L": 0.8}).relative_residual < 1e-7
    assert not ledger(g, run).closes


def test_what_is_missing_is_named() -> None:
    g = rlc()
    time = np.linspace(0.0, 1.0, 11)
    with pytest.raises(UnusableInput, match="lacks p_L, V; simulate with observed"):
        ledger(g, Trajectory("rlc", time, {"q_C_1": time}))
    with pytest.raises(UnusableInput, match="rising time"):
        ledger(g, Trajectory("rlc", time[::-1], {}))
    run = simulate(g, time, {"V": time}, observed=observables(g))
    for wrong in ({"parameters": {"L_1": 1.0}}, {"hold": "smooth"}):
        with pytest.raises(KeyError):
            ledger(g, run, **wrong)
    s = hysteretic(Hysteretic(SLIPS))
    run = simulate(s, time, {"V_in": time}, observed=observables(s))
    bare = Trajectory("s", time, run.outputs)
    with pytest.raises(UnusableInput, match="law of C_nl has memory"):
        ledger(s, bare)
    with pytest.raises(KeyError):
        ledger(g, simulate(g, time, {"V": time}, observed=observables(g)))["nothing"]


def test_heat_of_the_pseudo_domain_is_not_counted_as_power() -> None:
    with BondGraph("heater") as g:
        loop, room = One("loop"), Zero("room")
        Se("V") >> loop >> RS("R_h", ratio=2.0) >> room
        loop >> I("L", 0.1)
        room >> C("air", 50.0)
        room >> R("wall", 0.3)
    time = np.linspace(0.0, 1.0, 801)
    run = integrated(g, time, lambda t: 3.0 + np.sin(5.0 * t), [0.0, 0.0])
    a = ledger(g, run, hold="band-limited")
    assert a["air"].role == a["wall"].role == "signal"
    assert a.relative_residual < 1e-6
    # what the resistor lost is what the room took up as heat
    heat = run["q_air"][-1] + 0.0
    flow = motion(g, run, hold="band-limited").signals["f_wall"]
    gone = np.trapezoid(flow, time)
    assert a["R_h"].lost[-1] == pytest.approx(heat + gone, rel=1e-5)


@pytest.mark.parametrize(
    "model", [rlc, coupled, crank, plate, lambda: stack_bond_graph(external_force=True)]
)
def test_junctions_and_two_ports_keep_power_for_any_signals(model: Any) -> None:
    balance = power_balance(model())
    assert balance.proofs
    assert balance.holds
    assert all(p.remainder == 0 and p.power != 0 for p in balance.proofs)


def test_modulated_two_ports_are_in_the_proof() -> None:
    proof = power_balance(crank())["slider"]
    assert len(proof.power.args) == 2
    assert proof.remainder == 0
    with pytest.raises(KeyError):
        power_balance(crank())["J"]


@pytest.mark.parametrize("seed", range(25))
def test_random_graphs_keep_power(seed: int) -> None:
    assert power_balance(random_graph(seed)).holds


def test_a_reaction_dissipates_and_is_not_called_conservative() -> None:
    with BondGraph("reaction") as g:
        a, b = Zero("A"), Zero("B")
        a >> RE("r", ratio=2.0) >> b
        a >> C("c_A", 1.0)
        b >> C("c_B", 1.0)
    proof = power_balance(g)["r"]
    e_a, e_b = sp.symbols("e_A e_B", real=True)
    expected = 2 * (sp.exp(e_a) - sp.exp(e_b)) * (e_a - e_b)
    r = g.parameters["r"].symbol
    assert proof.claim == "dissipates"
    assert sp.expand(proof.remainder.subs(r, 2) - expected) == 0


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("seed", range(12))
def test_random_graphs_close(seed: int) -> None:
    g = random_graph(seed)
    try:
        model = equations(g)
    except GraphError:
        pytest.skip("refused by the engine")
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 1.0, 401)
    run = integrated(g, time, lambda t: np.sin(3 * t) + 0.2, rng.normal(size=model.order))
    if model.input_rates:
        pytest.skip("needs the rate of the input")
    assert ledger(g, run, hold="band-limited").relative_residual < 1e-4
