"""The lumped stack: derivation, operator inverse, printed numbers, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from actuators import stack_lumped
from actuators.models.catalogue import MODELS
from bondgraph import BondGraph, C, DerivativeCausality, Df, GraphError, One, Se
from bondgraph.equations.derivation import equations
from bondgraph.hysteresis import MaxwellResistiveCapacitor, inverse_of_identity_plus
from bondgraph.laws import Hysteretic
from bondgraph.simulation.lure import compile_model
from tests.settled import simulate
from tests.symbols import closed, same

Cs, T, k, m, b, Re = sp.symbols("C T k m b R_e", positive=True)
Vin, Fe, qH, qC, x, mom = sp.symbols("V_in F_e q_H q_C q_k p_m", real=True)
TABLE = MaxwellResistiveCapacitor.stack_2hz()
PER = 1000


@pytest.fixture(scope="module")
def slow() -> Any:
    """Three periods of 2 Hz, 0 to 100 V."""
    time = np.arange(3 * PER + 1) * (0.5 / PER)
    volt = 50 - 50 * np.cos(4 * np.pi * time)
    graph = stack_lumped(Hysteretic(TABLE))
    observed = ("e_H", "q_H", "e_clamp")
    run = simulate(graph, time, {"V_in": volt}, observed=observed, accuracy=1e-5)
    return volt, run


def test_derivation_without_resistance() -> None:
    """The charge is the unknown of one equation: its law and the clamped capacitance in series."""
    model = compile_model(stack_lumped(Hysteretic(TABLE), external_force=True)).model
    (unknown,) = model.algebraic
    rest = model.shown(unknown.residual)
    assert same(rest, (qH - Cs * Vin - T * x) / Cs + sp.Function("H")(qH))
    space = closed(model)
    rates = dict(zip(space.x, space.dxdt, strict=True))
    assert list(space.x) == [mom, x]
    assert same(rates[x], mom / m)
    acceleration = rates[mom] / m
    v_t = (m * acceleration + b * rates[x] + k * x - Fe) / T
    assert same(model.shown("e_clamp"), v_t)
    assert same(model.shown("e_H"), Vin - v_t)
    assert same(model.shown("q_H"), qH)
    assert same(model.shown("q_H"), T * x + Cs * v_t)
    assert model.causality.derivative == ("H",)


def test_derivation_with_resistance() -> None:
    model = equations(
        stack_lumped(Hysteretic(TABLE), resistance=5.0, external_force=True, sensors=("x", "i"))
    )
    space = closed(model)
    rates = dict(zip(space.x, space.dxdt, strict=True))
    i = (Vin - sp.Function("H")(qH) - qC / Cs) / Re
    assert model.causality.derivative == ()
    assert same(rates[qH], i)
    assert same(rates[qC], i - T * mom / m)
    assert same(rates[x], mom / m)
    assert same(rates[mom], T * qC / Cs + Fe - b * mom / m - k * x)
    assert same(space.y[1], x)
    assert same(space.y[0], i)
    # q = T x + C V_t as a first integral
    assert same(rates[qH] - rates[qC] - T * rates[x], 0)


def test_linear_models() -> None:
    model = compile_model(stack_lumped()).model
    assert same(model.rates[0], T * Vin - b * mom / m - k * x)
    assert same(model.signal("q_C"), Cs * Vin)
    with_lead = equations(stack_lumped(resistance=5.0, sensors=("x", "i")))
    assert list(with_lead.states) == ["q_C", "p_m", "q_k"]
    assert "stack_lumped" in MODELS
    assert MODELS["stack_lumped"]().check() == ()


def test_loop_closes_without_algebraic_loop(slow: Any) -> None:
    volt, run = slow
    values = {n: q.value for n, q in equations(stack_lumped()).parameters.items()}
    q, e_h = run["q_H"], run["e_H"]
    assert np.abs(volt - e_h - run["e_clamp"]).max() < 1e-12
    drive = values["C"] * volt + values["T"] * run["x"]
    inverse = inverse_of_identity_plus(values["C"], TABLE)
    exact, _ = inverse.run(drive)
    residual = (q - exact) / values["C"]
    assert np.abs(residual).max() < 1e-12
    hysteretic, _ = TABLE.run(q)
    assert np.abs(hysteretic - e_h).max() < 1e-12
    assert np.abs(run["q_H"] - run.laws["H"][0]).max() < 1e-14 * np.ptp(q)


def test_published_numbers(slow: Any) -> None:
    volt, run = slow
    top = 2 * PER + PER // 2
    assert volt[top] == pytest.approx(100.0)
    assert run["q_H"][top] == pytest.approx(140.8e-6, abs=0.05e-6)
    assert run["e_H"][top] == pytest.approx(16.69, abs=5e-3)
    assert run["x"][top] == pytest.approx(4511.6e-9, abs=0.1e-9)
    assert run["x"][2 * PER] == pytest.approx(510.9e-9, abs=0.3e-9)
    up, down = slice(2 * PER, top + 1), slice(top, 3 * PER + 1)
    grid = np.linspace(0, 100, 4001)
    rising = np.interp(grid, volt[up], run["x"][up])
    falling = np.interp(grid, volt[down][::-1], run["x"][down][::-1])
    assert np.max(falling - rising) == pytest.approx(531e-9, abs=0.7e-9)


def test_loss_of_the_steady_loop(slow: Any) -> None:
    """Work through the source over the third period is what the Maxwell elements lose."""
    _, run = slow
    q, e_h = run["q_H"][2 * PER :], run["e_H"][2 * PER :]
    work = float(np.sum(0.5 * (e_h[1:] + e_h[:-1]) * np.diff(q)))
    loss = float(TABLE.loop_loss(0.5 * np.ptp(q)))
    assert work == pytest.approx(loss, rel=1e-4)


def test_small_resistance_is_the_limit() -> None:
    time = np.arange(2001) * 2.5e-4
    command = {"V_in": 50 - 50 * np.cos(4 * np.pi * time)}
    stiff = simulate(stack_lumped(Hysteretic(TABLE)), time, command)
    lead = simulate(stack_lumped(Hysteretic(TABLE), resistance=0.1), time, command)
    assert np.abs(stiff["x"] - lead["x"]).max() < 1e-4 * np.ptp(stiff["x"])


def test_current_needs_a_resistance() -> None:
    with pytest.raises(GraphError, match="give resistance="):
        stack_lumped(sensors=("x", "i"))
    with BondGraph("loop") as g:
        loop = One("loop")
        Se("V") >> loop >> C("C_1", 1e-6)
        loop >> C("H", law=Hysteretic(TABLE))
        loop >> Df("i")
    with pytest.raises(DerivativeCausality, match=r"Df i reads .* flow of H.*resistance in series"):
        compile_model(g)


def test_order_of_declaration_does_not_matter() -> None:
    """The store with the law is the one that is solved, also when it is declared first."""
    with BondGraph("loop") as g:
        loop = One("loop")
        Se("V") >> loop >> C("H", law=Hysteretic(TABLE))
        loop >> C("C_1", 1e-6)
    assert compile_model(g).model.causality.derivative == ("H",)
