"""The stack under charge drive: equations, collapse of the loop, drift and leakage."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from actuators import stack_bond_graph, stack_lumped
from actuators.stack.charge_drive import (
    charge_of,
    corner_frequency,
    current_driven,
    current_for,
    with_spring_load,
)
from actuators.stack.conversions import Polarised, polarisation_operator
from actuators.stack.loop_width import loop_of
from bondgraph import BondGraph, C, GraphError
from bondgraph.equations.derivation import equations
from bondgraph.hysteresis import Ang, MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic, StopSum
from bondgraph.simulation.lure import compile_model
from bondgraph.support.errors import UnusableInput
from tests.settled import simulate
from tests.symbols import closed

LENGTH, RATIO = 18e-3, 0.0327
MAXWELL = Hysteretic(MaxwellResistiveCapacitor.stack_2hz())
ANG = Hysteretic(polarisation_operator(Ang.stack_2hz(), Polarised(RATIO, LENGTH)))
TIME = np.arange(1501) * 1e-3
WAVE = 0.5 - 0.5 * np.cos(4 * np.pi * TIME)
LAST = slice(1000, 1500)


def from_rest(graph: BondGraph, time: np.ndarray, current: np.ndarray) -> np.ndarray:
    start = np.zeros(compile_model(graph).n_x)
    return simulate(graph, time, {"i_in": current}, x0=start)["x"]


def test_equations_of_the_lumped_stack() -> None:
    space = equations(current_driven(stack_lumped(MAXWELL)))
    rates = closed(space).rates
    i, mom = sp.symbols("i_in p_m", real=True)
    m, t = sp.symbols("m T", positive=True)
    assert space.causality.derivative == ()
    assert sp.simplify(rates["q_H"] - i) == 0
    assert sp.simplify(rates["q_C"] - (i - t * mom / m)) == 0


@pytest.mark.parametrize("make", [stack_lumped, stack_bond_graph])
def test_leak_takes_the_terminal_voltage(make: Any) -> None:
    graph = current_driven(make(sensors=("x",)), leak=1e7)
    assert graph.check() == ()
    space = equations(graph)
    assert space.causality.derivative == ()
    leak = sp.Symbol("R_leak", positive=True)
    flow = space.signal("f_R_leak")
    assert sp.simplify(flow - space.signal("e_terminal") / leak) == 0


def test_lead_resistance_moves_before_the_leak() -> None:
    graph = current_driven(stack_bond_graph(), leak=1e7)
    assert graph.neighbour("R_e") == "lead"
    assert current_driven(stack_bond_graph()).neighbour("R_e") == "loop"


def test_parameters_survive() -> None:
    before = stack_bond_graph(StopSum((1e-9, 2e-9)), external_force=True)
    after = current_driven(before, leak=1e7)
    assert set(after.parameters) == set(before.parameters) | {"R_leak"}
    changed = after.with_values({"T": 0.04, "k": 50e6})
    assert changed.parameters["T"].value == 0.04
    assert set(after.elements) - set(before.elements) == {"i_in", "lead", "terminal", "R_leak"}


def test_only_a_voltage_source_can_be_replaced() -> None:
    with pytest.raises(GraphError, match="clamp is a 0, not an effort source"):
        current_driven(stack_lumped(), source="clamp")


def test_polarisation_operator_gives_the_loop_of_the_operator() -> None:
    volt = 100 * WAVE
    run = simulate(stack_bond_graph(ANG), TIME, {"V_in": volt})
    wanted, _ = Ang.stack_2hz().run(volt)
    assert np.abs(run["x"] - wanted).max() < 2e-9
    assert loop_of(volt[LAST], run["x"][LAST]).thickness == pytest.approx(766e-9, abs=2e-9)


@pytest.mark.parametrize("load", [0.0, 20e6])
@pytest.mark.parametrize("kind", ["lumped", "bond graph"])
def test_charge_drive_closes_the_loop(kind: str, load: float) -> None:
    graph = stack_lumped(MAXWELL) if kind == "lumped" else stack_bond_graph(ANG)
    if load:
        graph = with_spring_load(graph, load)
    p = {n: v.value for n, v in graph.parameters.items()}
    volt = simulate(graph, TIME, {"V_in": 100 * WAVE})["x"]
    by_volt = loop_of(100 * WAVE[LAST], volt[LAST])
    current = current_for(TIME, 140e-6 * WAVE)
    q = charge_of(TIME, current)
    x = from_rest(current_driven(graph), TIME, current)
    by_charge = loop_of(q[LAST], x[LAST])
    assert by_volt.percent > 12.0
    assert abs(by_charge.percent) < 0.01
    if kind == "lumped":
        slope = p["T"] / (p["C"] * (p["k"] + load) + p["T"] ** 2)
    else:
        slope = p["T"] * p["k"] / (p["k"] + load)
    assert np.abs(x - slope * q).max() < 1e-3 * np.ptp(x)


def test_mechanical_hysteresis_remains() -> None:
    slip = MaxwellResistiveCapacitor((20e6,), (20.0,))
    load = (C("load", law=Hysteretic(slip), unit="N/m"),)
    graph = stack_bond_graph(ANG).with_branch("body", load)
    current = current_for(TIME, 140e-6 * WAVE)
    q = charge_of(TIME, current)
    x = from_rest(current_driven(graph), TIME, current)
    # x = T q - F(x) / k is a contraction, as the load is softer than the stack
    at_rest = RATIO * q
    for _ in range(40):
        at_rest = RATIO * q - slip.run(at_rest)[0] / 65e6
    assert np.abs(x - at_rest).max() < 1e-3 * np.ptp(x)
    assert loop_of(q[LAST], x[LAST]).percent > 10.0


@pytest.mark.parametrize("kind", ["lumped", "bond graph"])
def test_offset_current_drifts(kind: str) -> None:
    graph = stack_lumped(MAXWELL) if kind == "lumped" else stack_bond_graph(ANG)
    time = np.arange(501) * 1e-2
    x = from_rest(current_driven(graph), time, np.full(501, 1e-6))
    rate = (x[-1] - x[100]) / (time[-1] - time[100])
    wanted = 3.52 / (65e6 * 1.5e-6 + 3.52**2) if kind == "lumped" else RATIO
    assert rate == pytest.approx(1e-6 * wanted, rel=1e-3)
    assert rate == pytest.approx(0.032e-6, rel=0.03)  # um/s for 1 uA


def test_leak_decays_with_r_times_free_capacitance() -> None:
    leak, free = 1e6, 1.5e-6 + 3.52**2 / 65e6
    graph = current_driven(stack_lumped(), leak=leak)
    time = np.linspace(0, 6.0, 3001)
    pulse = np.where(time < 0.01, 1e-2, 0.0)
    x = from_rest(graph, time, pulse)
    tail = slice(500, 3001)
    slope = np.polyfit(time[tail], np.log(x[tail]), 1)[0]
    assert -1 / slope == pytest.approx(leak * free, rel=1e-3)


def test_corner_frequency_halves_the_power() -> None:
    free = 1.65e-6
    f = corner_frequency(10e6, free)
    time = np.linspace(0, 8.0, 4001) / f
    current = current_for(time, 80e-6 * np.sin(2 * np.pi * f * time))
    x = from_rest(current_driven(stack_bond_graph(), leak=10e6), time, current)[3500:]
    assert np.ptp(x) / (2 * 80e-6 * RATIO) == pytest.approx(np.sqrt(0.5), rel=1e-3)
    with pytest.raises(UnusableInput, match="positive"):
        corner_frequency(0.0, free)


def test_leak_opens_the_loop_again() -> None:
    current = current_for(TIME, 140e-6 * WAVE)
    q = charge_of(TIME, current)
    sizes = [
        abs(
            loop_of(
                q[LAST], from_rest(current_driven(stack_lumped(), leak=r), TIME, current)[LAST]
            ).percent
        )
        for r in (1e6, 1e7)
    ]
    assert sizes[0] > 5.0
    assert 0.1 * sizes[0] < sizes[1] < 0.2 * sizes[0]


def test_current_and_charge() -> None:
    charge = 1e-4 * WAVE
    assert np.abs(charge_of(TIME, current_for(TIME, charge)) - charge).max() < 1e-4 * 1e-4
    with pytest.raises(UnusableInput, match="3 samples"):
        current_for([0.0, 1.0], [0.0, 1.0])
