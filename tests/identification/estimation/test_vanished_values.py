"""A value that has vanished beside another one is no knowledge of the other one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from identification.estimation import Study
from identification.estimation.covariance import interval_covariance
from identification.estimation.estimates import estimates_of
from tests.identification.estimation.plants import record


def two_dampers() -> BondGraph:
    """Only the sum of both shows."""
    with BondGraph("two_dampers") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        v >> R("d", 1.0, unit="N*s/m")
        v >> R("e", 1.0, unit="N*s/m")
        v >> C("k", stiffness=200.0, unit="N/m")
        v >> Dq("x", unit="m")
    return g


@pytest.mark.parametrize("begun", [False, True], ids=["from declared values", "begun there"])
@pytest.mark.parametrize("left", [1.0, 0.1, 1e-3, 1e-6])
def test_the_interval_of_one_damper_allows_for_what_the_other_may_take(
    left: float, begun: bool
) -> None:
    """Wherever the fit began: a study after a diagnosis starts at the values that were found."""
    asked = Study(two_dampers(), [record(noise=2e-4)], free=("d", "e"), hold="linear")
    found = {"d": 2.0 - left, "e": left}
    stack = (asked.starting(found) if begun else asked).stack()
    point = stack.start()
    theta = point.theta.copy()
    theta[:2] = [0.0, 0.0] if begun else np.log([*found.values()])
    point = replace(point, theta=theta)
    covariance, _ = interval_covariance(stack, stack.evaluate(point), point)
    d, e = estimates_of(stack, point, covariance)[0]
    assert d.ci95[0] < 1.0 < d.ci95[1]
    assert e.ci95[0] < left < e.ci95[1]
