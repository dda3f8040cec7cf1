"""python-control reads the models: responses against the simulation, names kept, refusals."""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

import control as ct
import numpy as np
import pytest

from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.hysteresis import stack_ang, stack_hysteresis
from bondgraph import BondGraph, I, MSe, One, R, UnknownName, UnusableInput
from bondgraph.equations.codegen import program
from bondgraph.export.control import control_module, to_control, to_nonlinear_control
from bondgraph.export.linear import linear_model
from bondgraph.laws import Coulomb, Polynomial
from tests.bondgraph.export.loop_program import cubic_loop
from tests.settled import simulate
from tests.spring import spring


def oscillator(law: Any = None, damper: Any = None, name: str = "oscillator") -> BondGraph:
    return spring(law=law, friction=damper, name=name)


def test_linear_response_is_that_of_the_simulation() -> None:
    graph = stack_bond_graph(sensors=("x", "i"))
    system = to_control(program(graph))
    time = np.linspace(0.0, 4e-3, 801)
    volt = 50.0 * np.sin(2 * np.pi * 500.0 * time)
    found = ct.forced_response(system, time, volt)
    expected = simulate(graph, time, {"V_in": volt}, x0=np.zeros(3))
    for row, name in enumerate(system.output_labels):
        error = np.abs(found.outputs[row] - expected[name]).max()
        assert error < 1e-9 * np.ptp(expected[name]), name


def test_names_are_kept() -> None:
    system = to_control(program(stack_bond_graph(sensors=("x", "i"), external_force=True)))
    assert isinstance(system, ct.StateSpace)
    assert system.name == "stack_bond_graph"
    assert system.state_labels == ["q_C_nl", "q_k", "p_m"]
    assert system.input_labels == ["V_in", "F_e"]
    assert sorted(system.output_labels) == ["i", "x"]
    by_name = system["x", "F_e"]
    assert by_name.input_labels == ["F_e"]


def test_bode_finds_the_resonance_of_a_steady_simulation() -> None:
    graph = oscillator()
    system = to_control(program(graph))
    omega = 18.0
    magnitude, phase, _ = ct.frequency_response(system, [omega])
    time = np.arange(40001) * (2 * np.pi / omega / 400)
    x = simulate(graph, time, {"F": np.sin(omega * time)})["x"][-4000:]
    wave = 2 * np.mean(x * np.exp(-1j * omega * time[-4000:])) * 1j
    assert abs(wave) == pytest.approx(float(np.squeeze(magnitude)), rel=1e-3)
    assert np.angle(wave) == pytest.approx(float(np.squeeze(phase)), abs=1e-3)


def test_a_model_without_states_is_a_gain() -> None:
    system = to_control(program(stack_hysteresis()))
    assert system.nstates == 0
    assert system.D.item() == pytest.approx(3.52 / 65e6, rel=1e-14)


def test_linear_loops_are_eliminated() -> None:
    system = to_control(cubic_loop(cubic=0.0, linear=2.0))
    assert [m.item() for m in (system.A, system.B, system.C, system.D)] == [-0.5, 0.5, 0.5, 0.5]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: program(oscillator(law=Polynomial())), None),
        (lambda: program(oscillator(damper=Coulomb())), "the rate of p_m is the first"),
        (cubic_loop, "the equation for z is the first"),
        (lambda: program(stack_ang()), "V_in has memory"),
        (lambda: cubic_loop(0.0, 0.0), "singular"),
        (lambda: cubic_loop(0.0, float("nan")), "is not finite"),
    ],
)
def test_only_what_is_linear_is_linear(make: Any, words: str | None) -> None:
    if words is None:  # the coefficients of the polynomial are nominally zero
        assert to_control(make()).nstates == 2
        return
    with pytest.raises(UnusableInput, match=words) as caught:
        to_control(make())
    assert "\n" not in str(caught.value)


def test_a_constant_source_is_refused_with_what_a_shell_user_can_do() -> None:
    with BondGraph("hung") as g:
        _ = MSe("weight", -784.8, unit="N") >> (body := One("body")) >> I("m", 80.0, unit="kg")
        _ = body >> R("d", 400.0, unit="N*s/m")
    with pytest.raises(UnusableInput, match=r"is -784\.8 .*Se instead of MSe"):
        to_control(program(g))


def test_nominal_coefficients_decide_whether_a_polynomial_is_linear() -> None:
    straight = program(oscillator(law=Polynomial()))
    at = straight.parameters.index("a_3_k")
    assert linear_model(straight).a.shape == (2, 2)
    bent = replace(straight, nominal=(*straight.nominal[:at], 5.0, *straight.nominal[at + 1 :]))
    with pytest.raises(UnusableInput, match="nominal parameters, the rate of p_m is the first"):
        linear_model(bent)


def test_nonlinear_response_is_that_of_the_simulation() -> None:
    graph = oscillator(law=Polynomial(half=0.01))
    system = to_nonlinear_control(program(graph))
    assert system.state_labels == list(program(graph).states)
    assert system.input_labels == ["F"]
    assert system.output_labels == ["x"]
    assert system.params["k"] == 200.0
    time = np.linspace(0.0, 1.0, 501)
    force = 3.0 * np.sin(15.0 * time)
    values = {"a_3_k": 2.0, "d": 3.0}
    found = ct.input_output_response(
        system, time, force, params=values, solve_ivp_kwargs={"rtol": 1e-8, "atol": 1e-10}
    )
    expected = simulate(graph, time, {"F": force}, values, x0=np.zeros(2), accuracy=1e-6)["x"]
    assert np.abs(found.outputs - expected).max() < 1e-4 * np.ptp(expected)
    bent = np.abs(simulate(graph, time, {"F": force}, {"d": 3.0}, x0=np.zeros(2))["x"] - expected)
    assert bent.max() > 0.1 * np.ptp(expected)


def test_loops_are_solved_inside() -> None:
    system = to_nonlinear_control(cubic_loop())
    y = system.output(0.0, [0.5], [1.5])
    assert y + y**3 == pytest.approx(2.0, rel=1e-12)
    assert system.dynamics(0.0, [0.5], [1.5]) == pytest.approx(y - 0.5, rel=1e-12)


def test_linearised_at_rest_is_the_linear_model() -> None:
    p = program(oscillator())
    a = ct.linearize(to_nonlinear_control(p), [0, 0], [0], copy_names=True)
    assert a.state_labels == list(p.states)
    b = to_control(p)
    assert a.A == pytest.approx(b.A, rel=1e-8)
    assert a.C == pytest.approx(b.C, rel=1e-8)


def test_memory_and_unknown_parameters_are_refused_in_one_line() -> None:
    with pytest.raises(UnusableInput, match="carry it") as caught:
        to_nonlinear_control(program(stack_ang()))
    with pytest.raises(UnusableInput, match=r"bondgraph\.export\.control\.to_nonlinear_control\("):
        to_control(cubic_loop())
    assert "V_in has memory" in str(caught.value)
    system = to_nonlinear_control(cubic_loop())
    with pytest.raises(UnknownName, match="no parameter 'kk' in cubic_loop"):
        system.dynamics(0.0, [0.0], [0.0], params={"kk": 1.0})


@pytest.mark.parametrize(
    "make", [lambda: stack_bond_graph(sensors=("x", "i")), lambda: stack_hysteresis()]
)
def test_the_written_module_is_the_same_system(make: Any, tmp_path: Path) -> None:
    p = program(make())
    file = tmp_path / "model.py"
    file.write_text(control_module(p), encoding="ascii")
    found, expected = runpy.run_path(str(file))["system"](), to_control(p)
    for k in "ABCD":
        assert (getattr(found, k) == getattr(expected, k)).all()
    assert found.state_labels == expected.state_labels
    assert found.input_labels == expected.input_labels
    assert found.output_labels == expected.output_labels


def test_a_hostile_name_stays_a_name(tmp_path: Path) -> None:
    name = 'evil"""\nraise SystemExit(1)\n"""\\'
    file = tmp_path / "model.py"
    file.write_text(control_module(program(oscillator(name=name))), encoding="ascii")
    assert runpy.run_path(str(file))["NAME"] == name
