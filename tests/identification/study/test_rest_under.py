"""The rest that a fit starts from, and how it moves with the parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, MSe, One, Parameter, R, Se
from bondgraph.graph.parameter import symbol
from bondgraph.laws import Bilinear
from bondgraph.simulation.dynamics import ExactDynamics, dynamics_of
from bondgraph.support.arrays import Array
from identification.study.joint import refine_states
from identification.study.residual import Point, evaluate, rest_under, start_point
from tests.identification.estimation.plants import record, study
from tests.spring import spring


@dataclass(frozen=True)
class CountedRests(ExactDynamics):
    """Counts the rests that are asked for."""

    asked: list[int] | None = None

    def rest(self, p: Array, u: Array) -> Array:
        assert self.asked is not None
        self.asked.append(1)
        return ExactDynamics.rest(self, p, u)


def test_what_rests_at_zero_has_no_derivatives_and_is_asked_twice() -> None:
    made = dynamics_of(spring(2.0, 5.0, 100.0))
    assert made.lure is not None
    dynamics = CountedRests(made.lure, [])
    directions = range(len(dynamics.parameter_names))
    x, by_p = rest_under(dynamics, dynamics.vector({}), np.zeros(1), directions)
    assert not x.any()
    assert by_p.shape == (dynamics.n_x, len(directions))
    assert not by_p.any()
    assert len(dynamics.asked or ()) == 2


@pytest.mark.parametrize("force", [0.0, 3.0])
def test_a_preloaded_spring_moves_with_its_stiffness(force: float) -> None:
    """``(k + 50) x + 50 * 0.01 = F`` above the knee at -0.01."""
    dynamics = dynamics_of(spring(1.0, 5.0, 100.0, Bilinear(50.0, knee=-1e-2)))
    p, k = dynamics.vector({}), dynamics.parameter_names.index("k")
    x, by_k = rest_under(dynamics, p, np.array([force]), [k])
    place = [n.startswith("q_") for n in dynamics.state_names].index(True)
    assert x[place] == pytest.approx((force - 0.5) / 150.0, rel=1e-6)
    assert by_k[place, 0] == pytest.approx(-(force - 0.5) / 150.0**2, rel=1e-4)


def test_two_forces_that_balance_move_the_rest_each() -> None:
    """``k x = a - c``: zero as it is, and after both have grown by one share."""
    with BondGraph("balance") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> C("k", stiffness=100.0)
        body >> R("d", 1.0)
        MSe("up", symbol("a", positive=True)) >> body
        body >> MSe("down", symbol("c", positive=True))
        body >> Dq("x")
    dynamics = dynamics_of(g.with_parameters([Parameter(n, 2.0, "1") for n in ("a", "c")]))
    assert dynamics.lure is not None
    inputs = np.array([float(n == "one") for n in dynamics.lure.inputs])
    forces = [dynamics.parameter_names.index(n) for n in ("a", "c")]
    x, by_p = rest_under(dynamics, dynamics.vector({}), inputs, forces)
    assert not x.any()
    place = [n.startswith("q_") for n in dynamics.state_names].index(True)
    assert by_p[place] == pytest.approx([0.01, -0.01])


def test_states_are_refined_without_derivatives_by_parameters() -> None:
    (problem,) = replace(study(record(400)), initial="free").stack().problems
    point = start_point(problem)
    whole = evaluate(problem, point, scored=True)
    states = evaluate(problem, point, by_parameters=False, scored=True)
    assert states.residual == pytest.approx(whole.residual)
    for (rows, a), (others, b) in zip(whole.local, states.local, strict=True):
        assert rows == others
        assert b == pytest.approx(a, rel=1e-9, abs=1e-9 * np.abs(a).max())
    assert whole.jacobian[:, : len(problem.free)].any()
    assert not states.jacobian[:, : len(problem.free)].any()
    better = refine_states(problem, Point(point.theta, point.states + 0.1 * problem.state_scale))
    assert evaluate(problem, better, scored=True).cost <= 1.001 * whole.cost
