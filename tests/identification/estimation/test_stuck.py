"""A descent that is stuck beside a law with kinks goes on without the states' own step."""

from __future__ import annotations

import numpy as np

from bondgraph import BondGraph, C, Dq, I, One, R, Recording, Se
from bondgraph.laws import Stribeck
from identification.estimation import Study, estimate
from tests.settled import simulate

T = np.asarray(0.001 * np.arange(4000), np.float64)
PUSH = 6 * np.sin(2 * np.pi * 0.7 * T) * np.sin(2 * np.pi * 0.11 * T + 0.3) + 4 * np.sin(
    2 * np.pi * 2.3 * T + 1
)
NOISE = 4e-5


def guide(m: float, friction: Stribeck) -> BondGraph:
    with BondGraph("guide") as g:
        j = One("stage")
        Se("F", unit="N") >> j >> I("m", m, unit="kg")
        j >> R("d", 8.0, unit="N*s/m", law=friction)
        j >> C("k", stiffness=400.0, unit="N/m")
        j >> Dq("x", unit="m")
    return g


def test_a_whole_step_of_the_initial_states_does_not_hold_up_the_parameters() -> None:
    """Without the second descent it ends at four times the noise."""
    x = np.asarray(simulate(guide(1.1, Stribeck(1.2, 0.8, 0.01)), T, {"F": PUSH})["x"])
    x = x + NOISE * np.random.default_rng(4).standard_normal(T.size)
    run = Recording.from_arrays("run", {"t[s]": T, "F[N]": PUSH, "x[m]": x})
    made = estimate(Study(guide(1.0, Stribeck(0.5, 0.1, 0.1)), run, hold="linear"))
    assert made.rmse()["x"] < 1.5 * NOISE
