"""Initial states caught behind a kink: a fit goes on from rest where that is better."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se, Zero
from bondgraph.laws import Backlash
from bondgraph.signals.split import interleaved
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import Point, start_point
from tests.settled import simulate

N, DT, NOISE = 1500, 2e-3, 1e-5


def coupled(**values: float) -> BondGraph:
    """Two masses whose coupling has play."""
    with BondGraph("coupled") as g:
        drive, load, link, rod = One("v_1"), One("v_2"), Zero("link"), One("rod")
        Se("F", unit="N") >> drive >> C("g", stiffness=1500.0, unit="N/m")
        drive >> I("m_1", 0.5, unit="kg")
        drive >> R("b_1", 2.0, unit="N*s/m")
        drive >> link >> load
        play = Backlash(coefficient="k", stiffness=1500.0, width=1e-3, size=4e-3)
        link >> rod >> C("k", stiffness=1500.0, law=play, unit="N/m")
        rod >> R("d", 1.5, unit="N*s/m")
        load >> I("m_2", 0.5, unit="kg")
        load >> R("b_2", 2.0, unit="N*s/m")
        drive >> Dq("x_1", unit="m")
        load >> Dq("x_2", unit="m")
    return g.with_values(values)


@cache
def problem() -> Problem:
    rng = np.random.default_rng(1)
    t = np.asarray(DT * np.arange(N), np.float64)
    tones, phases = np.linspace(0.3, 15.0, 60), rng.uniform(0, 2 * np.pi, 60)
    u = np.cos(2 * np.pi * np.outer(t, tones) + phases).sum(axis=1)
    u = 25.0 * u / np.abs(u).max() * np.minimum(t / (100 * DT), 1.0)
    run = simulate(coupled(), t, {"F": u}, hold="linear")
    y = np.stack([run["x_1"], run["x_2"]], axis=1) + NOISE * rng.standard_normal((N, 2))
    data = Data("run", t, {"F": u}, y, ("x_1", "x_2"), np.full(2, NOISE), interleaved(0, N))
    return Problem(coupled(gap_k=0.8e-3, m_2=0.52, k=1450.0), data)


def begun(stretch: float) -> Fit:
    """Fit with the coupling stretched at the start, beyond its play."""
    p = problem()
    start = start_point(p)
    states = start.states.copy()
    states[0, p.dynamics.state_names.index("q_k")] = stretch
    return fit(p, start=Point(start.theta, states))


@pytest.mark.parametrize("stretch", [-2e-3, 3e-3])
def test_the_wrong_side_of_a_play_is_left_again(stretch: float) -> None:
    made = begun(stretch)
    assert made.status is FitStatus.CONVERGED
    assert made.cost < 2.0
    assert made.values["gap_k"] == pytest.approx(1e-3, rel=0.01)


def test_nothing_is_begun_anew_where_the_state_is_right() -> None:
    p = problem()
    right = fit(p)
    again = fit(p, start=right.point)
    assert again.iterations <= 1
    assert again.cost == pytest.approx(right.cost, rel=1e-4)
