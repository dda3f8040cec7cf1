"""The pure hysteresis models and the operators in other units."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from actuators.stack.hysteresis import stack_al_janaideh, stack_ang, stack_hysteresis
from actuators.stack.scaling import scaled
from bondgraph import GraphError
from bondgraph.equations.derivation import equations
from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    BadParameter,
    DeadZones,
    MaxwellResistiveCapacitor,
    PrandtlIshlinskii,
)
from tests.settled import simulate

RNG = np.random.default_rng(5)
WALK = np.cumsum(RNG.normal(size=4000))
WALK = 100.0 * (WALK - WALK.min()) / np.ptp(WALK)


@pytest.mark.parametrize(
    ("model", "operator"),
    [(stack_al_janaideh, AlJanaideh.stack_2hz()), (stack_ang, Ang.stack_2hz())],
)
def test_model_is_the_operator_on_any_input(model: Any, operator: Any) -> None:
    time = np.arange(WALK.size) * 1e-3
    x = simulate(model(), time, {"V_in": WALK})["x"]
    exact, _ = operator.run(WALK)
    assert np.abs(x - exact).max() < 1e-14 * 1e-6
    assert np.ptp(exact) > 3e-6


def test_model_is_sound_and_has_no_states() -> None:
    graph = stack_al_janaideh()
    assert graph.check() == ()
    assert equations(graph).states == ()
    assert str(equations(graph).outputs[0])


def test_gain_scales_the_stroke() -> None:
    time = np.arange(400) * 1e-3
    volt = WALK[:400]
    operator = Ang.stack_2hz()
    double = stack_hysteresis(operator, gain=2 * float(operator.linear_slope))
    x = simulate(double, time, {"V_in": volt})["x"]
    assert x == pytest.approx(2 * operator.run(volt)[0], rel=1e-12)


def test_linear_model_without_operator() -> None:
    time = np.arange(50) * 1e-3
    x = simulate(stack_hysteresis(), time, {"V_in": WALK[:50]})["x"]
    assert x == pytest.approx(3.52 / 65e6 * WALK[:50], rel=1e-12)


def test_operator_without_slope_is_refused() -> None:
    with pytest.raises(GraphError, match=r"give weights\[0\] > 0"):
        stack_hysteresis(PrandtlIshlinskii((0.0, 1.0), (0.0, 1e-9)))


@pytest.mark.parametrize(
    "operator",
    [
        AlJanaideh.stack_2hz(),
        AlJanaideh.stack_2hz().inverse(),
        Ang.stack_2hz(),
        Ang.stack_2hz().inverse(),
        MaxwellResistiveCapacitor.stack_2hz(),
        DeadZones((-30.0, 0.0, 20.0, 60.0), (-0.5, 2.0, 1.0, -1.5)),
    ],
)
def test_scaling_is_exact(operator: Any) -> None:
    b, a = 3.7, 0.013
    unit = 1e-6 if "Inverse" in type(operator).__name__ or operator.linear_slope > 1e3 else 1.0
    x = unit * (WALK - 20.0)
    other = scaled(operator, b, a)
    assert type(other) is type(operator)
    assert other.n_memory == operator.n_memory
    expected = a * operator.run(b * x)[0]
    assert np.abs(other.run(x)[0] - expected).max() < 1e-13 * np.ptp(expected)
    there_and_back = scaled(other, 1 / b, 1 / a)
    assert np.abs(there_and_back.run(x)[0] - operator.run(x)[0]).max() < 1e-12 * np.ptp(
        operator.run(x)[0]
    )


@pytest.mark.parametrize("gains", [(0.0, 1.0), (1.0, -1.0), (float("nan"), 1.0)])
def test_scaling_refuses_gains(gains: tuple[float, float]) -> None:
    with pytest.raises(BadParameter, match="must be positive"):
        scaled(AlJanaideh.stack_2hz(), *gains)
