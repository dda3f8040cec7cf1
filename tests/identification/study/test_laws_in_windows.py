"""A law of time on a record that is scored in windows: its clock does not start anew in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.graph.elements import I, One, R, Se
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Dq
from bondgraph.laws import Law
from bondgraph.signals.recording import Split
from bondgraph.support.ops import Ops
from identification.diagnosis.report import law
from identification.diagnosis.screening.port_response import probes
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import (
    evaluate,
    offset_scale,
    slots,
    start_point,
    time_memories,
    windows,
)
from tests.settled import simulate

N, DT = 1200, 1e-3


@dataclass(frozen=True)
class Jump(Law):
    """A reading that jumps at 0.5 s."""

    counts_time: ClassVar[bool] = True
    timed: ClassVar[bool] = True
    n_memory: ClassVar[int] = 1

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        return (Parameter(f"height_{element}", 0.0, "m", positive=False, scale=1e-3),)

    def initial_memory(self, s: float) -> tuple[float, ...]:
        return (0.0,)

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        return (memory[0] + p[-1],)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        return 0.5 * p[0] * (1 + ops.tanh((memory[0] + p[-1] - 0.5) / 1e-3))


def free_mass() -> BondGraph:
    with BondGraph("free mass") as g:
        node = One("v")
        Se("F", unit="N") >> node
        node >> I("m", 2.0, unit="kg")
        node >> R("b", 5.0, unit="N*s/m")
        node >> Dq("x", unit="m", law=Jump())
    return g


@pytest.fixture(scope="module")
def data() -> Data:
    t = DT * np.arange(N)
    u = np.sin(2 * np.pi * 3 * t) + 0.5 * np.sin(2 * np.pi * 11 * t)
    y = simulate(free_mass(), t, {"F": u}, {"height_x": 2e-3})["x"][:, None]
    split = Split(slice(0, 800), slice(800, N), "two thirds")
    return Data("run", t, {"F": u}, y, ("x",), 1e-3 * y.std(axis=0), split)


def test_jump_is_found_in_its_window(data: Data) -> None:
    problem = Problem(free_mass(), data, window=300)
    starts = [w.start for w in windows(problem)]
    assert len(starts) > 3
    for first in starts:
        begun = time_memories(problem, first)
        assert begun is None if first == 0 else begun == {"x": (first * data.dt,)}
    found = fit(problem)
    assert found.values["height_x"] == pytest.approx(2e-3, rel=1e-3)
    assert found.cost < 1e-3
    plain = replace(problem, graph=free_mass().with_element("x", law=None))
    assert time_memories(plain, 300) is None
    assert fit(plain).cost > 10


def test_derivatives_of_windows_with_such_a_law(data: Data) -> None:
    problem = Problem(free_mass(), data, window=300, starts={"height_x": 1e-3})
    point = start_point(problem)
    at = [f.parameter.name for f in problem.free].index("height_x")
    column = evaluate(problem, point).jacobian[:, at]
    ends = []
    for d in (1e-4, -1e-4):
        theta = point.theta.copy()
        theta[at] += d
        ends.append(-evaluate(problem, replace(point, theta=theta), derivatives=False).residual)
    difference = (ends[0] - ends[1]) / 2e-4
    np.testing.assert_allclose(column, difference, atol=1e-6 * np.abs(column).max())


def test_what_a_fit_is_seen_to_do_counts_from_the_start_of_the_record(data: Data) -> None:
    """A state that begins shortly before a leading rest ends leaves the clock of a law alone."""
    split = Split(slice(400, 800), slice(800, N), "without the rest")
    found = fit(Problem(free_mass(), replace(data, begin=300, split=split)))
    assert found.values["height_x"] == pytest.approx(2e-3, rel=1e-3)
    _, w = law._run(found, 0)
    assert w[480] == pytest.approx(0.0, abs=1e-6)
    assert w[520] == pytest.approx(2e-3, rel=1e-2)
    probed = probes(found)
    seen = probed._still[300:, 0] + found.point.theta[slots(found.problem).offsets] * offset_scale(
        found.problem
    )
    assert seen == pytest.approx(found.simulated[300:, 0], abs=1e-9)
