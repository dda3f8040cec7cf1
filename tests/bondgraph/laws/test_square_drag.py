"""Quadratic drag beside next to no linear one: a run may begin at a flow far from nothing."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bondgraph import BondGraph, C, De, R, Sf, Zero
from bondgraph.laws import Law, Orifice, QuadraticDrag
from bondgraph.signals.recording import Recording, Split
from identification.study.data import data_for
from identification.study.problem import Problem
from identification.study.residual import Point, evaluate, start_point

CAPACITY, DRAG = 6.3e-6, 6.15e10
LAWS = [QuadraticDrag(DRAG, "Pa*s2/m6"), Orifice(DRAG**-0.5, 1.0)]


def tank(law: Law) -> BondGraph:
    with BondGraph("tank") as g:
        t = Zero("tank")
        Sf("Q", unit="m3/s") >> t >> C("A", CAPACITY, unit="m3/Pa")
        t >> R("valve", 2e4, law=law, unit="Pa*s/m3")
        t >> De("p", unit="Pa")
    return g


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_a_full_tank_runs_empty(law: Law) -> None:
    t = np.arange(300.0)
    still = {"Q": np.zeros(t.size), "p": np.zeros(t.size)}
    recorded = Recording.from_arrays("tank", {"Q[m3/s]": still["Q"], "p[Pa]": still["p"]}, fs=1.0)
    split = Split(slice(0, 200), slice(200, 300), "its end")
    data = data_for(tank(law), recorded, split, {"p": 1.0})
    problem = Problem(tank(law), data)
    full = Point(start_point(problem).theta, np.array([[4800 * CAPACITY]]))
    p = evaluate(problem, full, derivatives=False).y[:, 0]
    # beside next to no linear drag the root of the pressure falls evenly (Torricelli)
    level = np.sqrt(4800.0) - 0.5 * t / (CAPACITY * np.sqrt(DRAG))
    early = t < 60
    assert np.isfinite(p).all()
    assert p[early] == pytest.approx(level[early] ** 2, rel=0.02)


@given(
    free=st.floats(-1e3, 1e3), gain=st.floats(-1e6, 0.0), k=st.floats(0.0, 1e9)
)  # fmt: skip
def test_the_root_is_the_law_at_the_flow_it_leaves(free: float, gain: float, k: float) -> None:
    s, g, c = (ca.SX.sym(n) for n in "sgc")
    law = QuadraticDrag(1.0)
    solved = ca.Function("w", [s, g, c], [law.solve(s, g, (), (c,), ca.SX(0.0))])
    w = float(solved(free, gain, k))
    f = free + gain * w
    exact = k * f * abs(f)
    # f is a difference: what it loses there shows in w
    lost = 2.0 * k * abs(f) * np.finfo(float).eps * (abs(free) + abs(gain * w))
    assert w == pytest.approx(exact, rel=1e-9, abs=8.0 * lost + 1e-300)
