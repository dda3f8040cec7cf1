"""The tangents of a fit over the whole record match differences, with and without windows."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.signals.recording import Split
from identification.diagnosis.screening.tangent_space import freedom
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import Point, evaluate
from tests.settled import simulate
from tests.spring import spring

N = 300


@pytest.mark.parametrize("window", [None, 60])
def test_tangents_match_differences(window: int | None) -> None:
    g = spring(1.0, 2.0, 80.0, speed="v")
    t = 0.01 * np.arange(N)
    u = np.sin(4 * t) + np.sin(11 * t)
    run = simulate(g, t, {"F": u})
    y = np.stack([np.asarray(run["x"]), np.asarray(run["v"])], axis=1)
    floor = 1e-2 * y.std(axis=0)
    y = y + floor * np.random.default_rng(0).standard_normal(y.shape)
    data = Data(
        "mass", t, {"F": u}, y, ("x", "v"), floor, Split(slice(0, 200), slice(200, N), "third")
    )
    found = fit(Problem(g, data, window=window), max_iterations=3)
    tangents = freedom(found)
    count = 1 if window is None else 5
    n_theta = found.point.theta.size
    assert tangents.shape == (N, 2, n_theta + 2 * count)
    for j in range(3):  # the parameters
        ends = []
        for sign in (1, -1):
            theta = found.point.theta.copy()
            theta[j] += sign * 1e-4
            ends.append(
                evaluate(found.problem, Point(theta, found.point.states), derivatives=False).y
            )
        numeric = (ends[0] - ends[1]) / 2e-4
        # the sign of a tangent is the residual's or the reading's: a span has none
        same = min(float(np.abs(tangents[:, :, j] - s * numeric).max()) for s in (1.0, -1.0))
        assert same < 1e-4 * np.abs(numeric).max()
    for k in range(count):  # an initial state acts in its own window only
        part = tangents[:, :, n_theta + 2 * k : n_theta + 2 * k + 2]
        seen = np.flatnonzero(np.abs(part).max(axis=(1, 2)))
        assert seen.size == (N if window is None else seen[-1] - seen[0] + 1)
        assert seen.size > 40
