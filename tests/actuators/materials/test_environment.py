"""Temperature, ageing, creep: laws, domains, and what they do to a simulated stack."""

from __future__ import annotations

import doctest
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from actuators import stack_bond_graph, stack_lumped
from actuators.materials.environment import CeramicAgeing, Environment, parameters_at
from actuators.materials.poled_ceramic import StackConstants
from actuators.materials.temperature import (
    TemperaturePolynomial,
    TemperatureTable,
    kelvin,
    thermal_expansion,
)
from actuators.stack.creep import LogarithmicCreep, chain_elements, fit_kelvin_voigt
from bondgraph import BondGraph, C, Dq, One, R, Se, UnknownName, UnusableInput, Zero
from bondgraph.hysteresis import KelvinVoigtCreep
from bondgraph.simulation.lure import compile_model
from tests.settled import simulate

DAY = 86400.0
STACK = StackConstants.from_free(65e6, 1.5e-6, 3.52)


@pytest.mark.parametrize(
    "module", ["materials.temperature", "materials.environment", "stack.creep"]
)
def test_examples_run(module: str) -> None:
    assert doctest.testmod(import_module(f"actuators.{module}")).failed == 0


# -- temperature --------------------------------------------------------------------------
def test_polynomial() -> None:
    law = TemperaturePolynomial(2e-3, 1e-5)
    assert law.factor(kelvin(20.0)) == pytest.approx(1.0)
    found = law.factor(np.array([[kelvin(30.0), kelvin(0.0)]]))
    assert found == pytest.approx(np.array([[1.021, 0.964]]))


def test_table() -> None:
    law = TemperatureTable((kelvin(0), kelvin(20), kelvin(50), kelvin(80)), (1.8, 2.0, 2.5, 2.6))
    assert law.factor([kelvin(0), kelvin(20), kelvin(50)]) == pytest.approx([0.9, 1.0, 1.25])
    between = law.factor(np.linspace(kelvin(0), kelvin(80), 500))
    assert (np.diff(between) > 0).all()
    assert between.max() == pytest.approx(1.3)


def test_expansion() -> None:
    assert thermal_expansion(18e-3, 5e-6, [0.0, -10.0]) == pytest.approx([0.0, -0.9e-6])


def test_ageing() -> None:
    law = CeramicAgeing(0.02, DAY)
    assert law.factor([DAY, 10 * DAY, 1000 * DAY]) == pytest.approx([1.0, 0.98, 0.94])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: TemperaturePolynomial(1e-3).factor(25.0), r"25 K is outside.*not degC"),
        (lambda: TemperaturePolynomial(1e-3).factor(float("nan")), "nan K is outside"),
        (lambda: TemperaturePolynomial(-0.1).factor(340.0), "factor falls to -3"),
        (lambda: TemperaturePolynomial(1e-3, lower=300.0), "must be in order"),
        (lambda: TemperatureTable((300.0, 290.0), (1.0, 1.0)), r"temperatures\[1\] = 290"),
        (lambda: TemperatureTable((280.0, 300.0), (1.0, 0.0)), r"values\[1\] = 0"),
        (lambda: TemperatureTable((300.0, 310.0), (1.0, 1.0)), "reference 293.15 K is outside"),
        (lambda: TemperatureTable((300.0,), (1.0,)), "at least two"),
        (lambda: thermal_expansion(-1.0, 1e-6, 1.0), "length = -1 m must be positive"),
        (lambda: CeramicAgeing(0.02).factor(1.0), "age 1 s is below the reference 86400 s"),
        (lambda: CeramicAgeing(2.0).factor(100 * DAY), "not per cent"),
        (lambda: CeramicAgeing(0.02, -1.0), "reference = -1 s positive"),
        (lambda: LogarithmicCreep(0.01).factor(0.01), "before the reference 0.1 s"),
        (lambda: LogarithmicCreep(float("inf")), "must be finite"),
        (lambda: chain_elements(KelvinVoigtCreep(1.0, (-0.1,), (1.0,)), 1.0), "weights .-0.1"),
        (lambda: chain_elements(KelvinVoigtCreep(0.0, (1.0,), (1.0,)), 1.0), "the gain 0 and"),
        (lambda: fit_kelvin_voigt(LogarithmicCreep(-0.01)), "only growing creep"),
        (lambda: fit_kelvin_voigt(LogarithmicCreep(0.01), 5.0, 0), "at least one unit"),
        (lambda: chain_elements(KelvinVoigtCreep(1.0, (1.0,), (1.0,)), 0.0), "stiffness = 0 N/m"),
    ],
)
def test_domains(call: Any, words: str) -> None:
    with pytest.raises(UnusableInput, match=words):
        call()


# -- parameters of the models -------------------------------------------------------------
def test_reference_changes_nothing() -> None:
    law = Environment({"d33": TemperaturePolynomial(1e-3)}, {"eps33": CeramicAgeing(0.03)})
    assert parameters_at(STACK, law) == pytest.approx(STACK.as_lumped())
    same = parameters_at(STACK, law, temperature=293.15, age=DAY)
    assert same == pytest.approx(STACK.as_lumped())


@pytest.mark.parametrize("model", ["stack_lumped", "stack_bond_graph"])
def test_warm_and_old_stack_in_a_simulation(model: Any) -> None:
    """Displacement follows d33, charge of the free stack eps33, whatever the model."""
    law = Environment(
        {"d33": TemperaturePolynomial(1e-3), "eps33": TemperaturePolynomial(4e-3)},
        {"d33": CeramicAgeing(0.02), "s33": CeramicAgeing(-0.01)},
    )
    warm = parameters_at(STACK, law, temperature=kelvin(50.0), age=100 * DAY, model=model)
    factory: Any = {"stack_lumped": stack_lumped, "stack_bond_graph": stack_bond_graph}[model]
    graph = factory(resistance=5.0, sensors=("x", "i"))
    time = np.linspace(0.0, 20e-3, 40_001)
    ramp = np.clip(time / 5e-3, 0.0, 1.0) * 100.0
    run = simulate(graph, time, {"V_in": ramp}, warm)
    assert run["x"][-1] == pytest.approx(100 * 3.52 / 65e6 * 1.03 * 0.96, rel=1e-6)
    charge = float(np.sum(0.5 * (run["i"][1:] + run["i"][:-1]) * np.diff(time)))
    assert charge == pytest.approx(100 * 1.5e-6 * 1.12, rel=1e-3)


def test_environment_refusals() -> None:
    with pytest.raises(UnknownName, match=r"no constant 'd_33'.*'d33'"):
        Environment({"d_33": TemperaturePolynomial(1e-3)})
    strong = Environment({"d33": TemperaturePolynomial(0.04)})
    with pytest.raises(UnusableInput, match="coupling above 1"):
        parameters_at(STACK, strong, temperature=kelvin(75.0))
    with pytest.raises(UnknownName, match="no model"):
        parameters_at(STACK, strong, model="stack")  # type: ignore[arg-type]


# -- creep --------------------------------------------------------------------------------
def answer(model: KelvinVoigtCreep, t: Any) -> Any:
    """Answer to a step of 1: ``gain + sum c_j (1 - exp(-t/tau_j))``."""
    growth = -np.expm1(-np.asarray(t)[..., None] / np.array(model.times, float))
    return float(model.gain) + growth @ np.array(model.weights, float)


def test_seven_units_for_five_decades() -> None:
    creep = LogarithmicCreep(0.02)
    model, error = fit_kelvin_voigt(creep, 5.0, 7)
    assert error < 0.0043
    t = np.geomspace(0.1, 1e4, 5000)
    gap = np.abs(answer(model, t) - creep.factor(t)).max() / (0.02 * 5)
    assert gap == pytest.approx(error, rel=0.05)
    errors = [fit_kelvin_voigt(creep, 5.0, n)[1] for n in (2, 3, 5, 7)]
    assert errors == sorted(errors, reverse=True)
    # the relative error does not depend on gamma
    assert fit_kelvin_voigt(LogarithmicCreep(0.005), 5.0, 7)[1] == pytest.approx(error)


def test_operator_answers_a_step() -> None:
    operator = KelvinVoigtCreep(0.9, (0.05, 0.02), (0.3, 5.0))
    t = np.linspace(0.0, 10.0, 401)
    memory = operator.initial_memory(1.0, (1.0, 0.0, 0.0))  # the input has just stepped to 1
    step, _ = operator.run(np.ones(t.size), memory, step=t[1])
    assert step == pytest.approx(answer(operator, t + t[1]), rel=1e-12)


def test_elements_in_a_bond_graph() -> None:
    """A force on the chain of springs and dampers creeps like the formula."""
    model, _ = fit_kelvin_voigt(LogarithmicCreep(0.1, 1e-3), 2.0, 3)
    stiffness, units = chain_elements(model, 1e6)
    with BondGraph("chain") as g:
        tip, force = One("tip"), Zero("force")
        Se("F", unit="N") >> tip >> force >> C("k", stiffness=stiffness, unit="N/m")
        for n, (spring, damper) in enumerate(units):
            unit = One(f"unit_{n}")
            force >> unit >> C(f"k_{n}", stiffness=spring, unit="N/m")
            unit >> R(f"b_{n}", damper, unit="N*s/m")
        tip >> R("b", 1e-3, unit="N*s/m")  # a touch of damping makes the first spring a state
        tip >> Dq("x", unit="m")
    time = np.linspace(0.0, 0.1, 101)
    n_x = compile_model(g).n_x
    run = simulate(g, time, {"F": np.full(101, 10.0)}, x0=np.zeros(n_x))
    assert len(units) == 3
    assert run["x"][1:] == pytest.approx(10.0 / 1e6 * answer(model, time[1:]), rel=1e-6)
