"""The rest that a fit starts from, and how it moves with the parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from bondgraph.laws import Bilinear
from bondgraph.support.arrays import Array
from identification.study.engine import ExactEngine, engine_of
from identification.study.joint import refine_states
from identification.study.residual import Point, evaluate, rest_under, start_point
from tests.identification.estimation.plants import record, study
from tests.spring import spring


@dataclass(frozen=True)
class CountedRests(ExactEngine):
    """Counts the rests that are asked for."""

    asked: list[int] | None = None

    def rest(self, p: Array, u: Array) -> Array:
        assert self.asked is not None
        self.asked.append(1)
        return ExactEngine.rest(self, p, u)


def test_what_rests_at_zero_has_no_derivatives_and_is_asked_twice() -> None:
    made = engine_of(spring(2.0, 5.0, 100.0))
    assert made.lure is not None
    engine = CountedRests(made.lure, [])
    directions = range(len(engine.parameter_names))
    x, by_p = rest_under(engine, engine.vector({}), np.zeros(1), directions)
    assert not x.any()
    assert by_p.shape == (engine.n_x, len(directions))
    assert not by_p.any()
    assert len(engine.asked or ()) == 2


@pytest.mark.parametrize("force", [0.0, 3.0])
def test_a_preloaded_spring_moves_with_its_stiffness(force: float) -> None:
    """``(k + 50) x + 50 * 0.01 = F`` above the knee at -0.01."""
    engine = engine_of(spring(1.0, 5.0, 100.0, Bilinear(50.0, knee=-1e-2)))
    p, k = engine.vector({}), engine.parameter_names.index("k")
    x, by_k = rest_under(engine, p, np.array([force]), [k])
    place = [n.startswith("q_") for n in engine.state_names].index(True)
    assert x[place] == pytest.approx((force - 0.5) / 150.0, rel=1e-6)
    assert by_k[place, 0] == pytest.approx(-(force - 0.5) / 150.0**2, rel=1e-4)


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
