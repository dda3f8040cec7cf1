"""scipy.signal reads the linear models: responses against the simulation, names kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import signal

from actuators.models.catalogue import MODELS
from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.hysteresis import stack_ang, stack_hysteresis
from bondgraph import BondGraph, C, De, One, R, Se, UnusableInput, Zero
from bondgraph.equations.codegen import program
from bondgraph.export.linear import linear_model
from tests.settled import simulate


@pytest.mark.parametrize("name", ["stack_with_payload", "resonator", "mass_with_viscous_friction"])
def test_lsim_is_the_simulation(name: str) -> None:
    graph = MODELS[name]()
    found = linear_model(program(graph))
    poles = np.abs(np.linalg.eigvals(found.system.A))
    step = 0.2 / poles.max()
    time = np.arange(2001) * step
    commands = {u: np.sin((0.03 + 0.01 * i) * np.arange(2001)) for i, u in enumerate(found.inputs)}
    u = np.column_stack(list(commands.values()))
    _, y, _ = signal.lsim(found.system, u, time)
    expected = simulate(graph, time, commands, x0=np.zeros(len(found.states)))
    y = y.reshape(time.size, -1)
    for column, output in enumerate(found.outputs):
        span = np.ptp(expected[output])
        assert span > 0
        assert np.abs(y[:, column] - expected[output]).max() < 1e-8 * span


def test_names_follow_the_matrices() -> None:
    p = program(stack_bond_graph(sensors=("x", "i"), external_force=True))
    found = linear_model(p)
    assert found.states == ("q_C_nl", "q_k", "p_m")
    assert found.inputs == ("V_in", "F_e")
    assert found.outputs == p.outputs
    assert found.system.A.shape == (3, 3)
    assert found.system.B.shape == (3, 2)
    assert found.system.D.shape == (2, 2)
    # the force enters the momentum and nothing else
    force = found.inputs.index("F_e")
    assert found.system.B[:, force].tolist() == [0.0, 0.0, 1.0]
    i, volt = found.outputs.index("i"), found.inputs.index("V_in")
    assert found.system.D[i, volt] == pytest.approx(1 / 5.0, rel=1e-14)


def test_gain_without_states() -> None:
    found = linear_model(program(stack_hysteresis()))
    _, y, _ = signal.lsim(found.system, [0.0, 100.0], [0.0, 1.0])
    assert y == pytest.approx([0.0, 100.0 * 3.52 / 65e6], rel=1e-14)


@pytest.mark.filterwarnings("ignore::scipy.signal.BadCoefficients")
def test_bode_of_a_first_order_lag() -> None:
    with BondGraph("rc") as g:
        loop, node = One("loop"), Zero("node")
        _ = Se("V") >> loop >> R("R_1", 2.0)
        _ = loop >> node >> C("C_1", 0.5)
        _ = node >> De("y")
    _, magnitude, phase = signal.bode(linear_model(program(g)).system, w=[0.1, 1.0, 3.0])
    expected = 1 / (1 + 1j * np.array([0.1, 1.0, 3.0]))
    assert 10 ** (magnitude / 20) == pytest.approx(np.abs(expected), rel=1e-12)
    assert np.radians(phase) == pytest.approx(np.angle(expected), rel=1e-12)


@pytest.mark.parametrize("make", [stack_ang])
def test_memory_is_refused(make: Any) -> None:
    with pytest.raises(UnusableInput, match="has memory"):
        linear_model(program(make()))
