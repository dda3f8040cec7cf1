"""A run that breaks off because its steps are too long is taken with finer ones."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, Df, I, One, R, Se, use
from bondgraph.graph.composing.components import COMPONENTS
from bondgraph.signals.recording import Recording
from identification.estimation import FitStatus, Study, estimate
from tests.settled import simulate

FREE = ("p_ratio", "b")


def boat() -> BondGraph:
    """A propeller on a hull: the shaft follows its torque within a fifth of a sample."""
    with BondGraph("boat") as g:
        shaft, hull = One("shaft"), One("hull")
        Se("M", unit="N*m") >> shaft
        propeller = use(COMPONENTS.make("propeller"), "p")
        shaft >> propeller.shaft
        propeller.hull >> hull
        hull >> I("m", 2.0, unit="kg")
        hull >> R("b", 0.5, unit="N*s/m")
        hull >> Df("v", unit="m/s")
        shaft >> R("rubs", 1e-4, unit="N*m*s/rad")
        shaft >> Df("w", unit="rad/s")
    return g


def under_way() -> Recording:
    """Begins while it runs."""
    t = 5e-3 * np.arange(900)
    torque = 0.2 + 0.15 * np.sin(4 * t)
    torque[:50] *= np.arange(50) / 50
    run = simulate(boat(), t, {"M": torque}, accuracy=1e-5)
    rng = np.random.default_rng(5)
    read = {
        f"{n}[{unit}]": run[n] * 1.0 + 1e-3 * np.std(run[n]) * rng.standard_normal(t.size)
        for n, unit in (("v", "m/s"), ("w", "rad/s"))
    }
    columns = {"t[s]": t, "M[N*m]": torque, **read}
    late = {n: column[400:] for n, column in columns.items()}
    return Recording.from_arrays("under way", late | {"t[s]": t[:500]})


def test_a_run_that_breaks_off_takes_finer_steps() -> None:
    recording = under_way()
    found = estimate(Study(boat().with_values({"b": 0.6}), recording, free=FREE))
    assert found.status is FitStatus.CONVERGED
    assert min(found.setting.n_sub) > 1
    assert found.values["p_ratio"] == pytest.approx(20.0, rel=0.02)
    assert found.values["b"] == pytest.approx(0.5, rel=0.05)
    stated = estimate(Study(boat(), recording, free=FREE, n_sub=1))
    assert stated.status not in (FitStatus.CONVERGED, FitStatus.NO_PROGRESS)
