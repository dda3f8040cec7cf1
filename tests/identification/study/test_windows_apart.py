"""Many short windows run in one call: the same to the last digit as one after the other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se
from bondgraph.laws import Coulomb, Law, QuadraticDrag
from bondgraph.signals.split import interleaved
from bondgraph.simulation.exact_run import run_many
from bondgraph.simulation.simulate import simulate
from bondgraph.support.native import compiler
from identification.study import residual
from identification.study.data import Data
from identification.study.joint import refine_states
from identification.study.problem import Problem
from identification.study.residual import Point, ResidualEvaluation, evaluate, start_point

N, STEP = 700, 1e-3
RNG = np.random.default_rng(0)
FORCE = np.repeat(RNG.normal(size=N // 5), 5) * 8.0
TIME = STEP * np.arange(N, dtype=float)


def slide(law: Law | None = None) -> BondGraph:
    with BondGraph("slide") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0)
        body >> R("d", 4.0, law=law)
        body >> C("k", stiffness=2000.0)
        body >> Dq("x")
        body >> Df("v")
    return g


def posed(graph: BondGraph, **options: Any) -> Problem:
    made = simulate(graph, TIME, {"F": FORCE})
    y = np.stack([made["x"], made["v"]], axis=1)
    floor = 0.01 * y.std(axis=0)
    noisy = y + floor * RNG.normal(size=y.shape)
    data = Data("run", TIME, {"F": FORCE}, noisy, ("x", "v"), floor, interleaved(0, N), "hold")
    return Problem(graph, data, **{"window": 37, "lags": False, **options})


def moved(problem: Problem) -> Point:
    begun = start_point(problem)
    theta = begun.theta.copy()
    theta[: len(problem.free)] += 0.02
    theta[-2:] += 0.3  # offsets
    return Point(theta, begun.states + 1e-3 * RNG.normal(size=begun.states.shape))


def same(a: ResidualEvaluation, b: ResidualEvaluation) -> None:
    assert a.y == pytest.approx(b.y, rel=1e-12, abs=1e-15, nan_ok=True)
    assert a.residual == pytest.approx(b.residual, rel=1e-10, abs=1e-10)
    assert a.jacobian == pytest.approx(b.jacobian, rel=1e-10, abs=1e-10 * _size(b.jacobian))
    assert [rows for rows, _ in a.local] == [rows for rows, _ in b.local]
    for (_, one), (_, other) in zip(a.local, b.local, strict=True):
        assert one == pytest.approx(other, rel=1e-10, abs=1e-10 * _size(other))


def _size(values: Any) -> float:
    return float(np.abs(values).max(initial=0.0))


WAYS: dict[str, dict[str, Any]] = {
    "all": {},
    "values": {"derivatives": False},
    "states": {"by_parameters": False, "scored": True},
    "few": {"scored": True, "among": {1, 5, 9}},
    "scored": {"scored": True},
}


@pytest.mark.skipif(compiler() is None, reason="nothing is compiled without gcc")
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("graph", [slide, lambda: slide(QuadraticDrag(0.3))], ids=["linear", "law"])
@pytest.mark.parametrize("n_sub", [1, 3])
def test_windows_in_one_call_are_those_one_by_one(
    way: str, graph: Callable[[], BondGraph], n_sub: int
) -> None:
    problem = posed(graph(), n_sub=n_sub)
    assert problem.apart
    point = moved(problem)
    together = evaluate(problem, point, **WAYS[way])
    problem.__dict__["apart"] = False
    same(together, evaluate(problem, point, **WAYS[way]))


def test_beyond_a_limit_nothing_is_told() -> None:
    problem = posed(slide())
    found = evaluate(problem, moved(problem), limit=1.0)
    assert found.cost == np.inf
    assert found.local == []


@pytest.mark.parametrize(
    "problem",
    [
        posed(slide(), window=None), posed(slide(), initial="rest"),
        posed(slide(Coulomb(0.5))), posed(slide(), clock=1e-4),
    ],
    ids=["whole", "rest", "jumps", "clock"],
)  # fmt: skip
def test_what_reaches_over_windows_or_needs_more_is_run_one_by_one(problem: Problem) -> None:
    assert not problem.apart


@pytest.mark.skipif(compiler() is None, reason="nothing is compiled without gcc")
def test_only_windows_that_may_gain_are_run_again() -> None:
    problem = posed(slide())
    point, counts = moved(problem), list[int]()

    def counted(ready: Any, u: Any, *more: Any) -> Any:
        counts.append(len(u))
        return run_many(ready, u, *more)

    with patch.object(residual, "run_many", counted):
        settled = refine_states(problem, point)
        counts.clear()
        refine_states(problem, settled)
    scored = sum(bool(problem.data.mask("train")[w].any()) for w in problem.windows)
    assert counts == [scored]
