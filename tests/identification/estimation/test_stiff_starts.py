"""A run that breaks off because its steps are too long is taken with finer ones."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, Df, I, One, R, Se, use
from bondgraph.graph.composing.components import COMPONENTS
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Recording
from identification.estimation import FitStatus, Study, estimate
from tests.settled import simulate

FREE = ("p_ratio", "b")


def boat() -> BondGraph:
    """A propeller on a hull: the shaft follows its torque within a fifth of a sample.

    Its water resists with the cube of the speed: a square one is solved by its formula.
    """
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
    cubic = Polynomial(0.0, 100.0, 10.0, (3,), "N*m")
    return g.with_element("p_load", law=cubic).with_values({"a_3_p_load": 10.0})


SPUN = {"p_p_J": 0.1, "q_p_memory": 0.0, "p_m": 0.0}
"""A shaft at 1000 rad/s: the water takes hold of it within a hundredth of a sample."""


def spun_up() -> Recording:
    """Begins with a shaft that was spun up out of the water."""
    t = 5e-3 * np.arange(500)
    torque = 0.2 + 0.15 * np.sin(4 * t)
    run = simulate(boat(), t, {"M": torque}, x0=SPUN, accuracy=1e-4)
    rng = np.random.default_rng(5)
    read = {
        f"{n}[{unit}]": run[n] * 1.0 + 1e-3 * np.std(run[n]) * rng.standard_normal(t.size)
        for n, unit in (("v", "m/s"), ("w", "rad/s"))
    }
    return Recording.from_arrays("spun up", {"t[s]": t, "M[N*m]": torque, **read})


def test_a_run_that_breaks_off_takes_finer_steps() -> None:
    recording = spun_up()
    study = Study(boat().with_values({"b": 0.6}), recording, free=FREE, initial=SPUN)
    found = estimate(study)
    assert found.status is FitStatus.CONVERGED
    assert min(found.setting.n_sub) > 1
    assert found.values["p_ratio"] == pytest.approx(20.0, rel=0.02)
    assert found.values["b"] == pytest.approx(0.5, rel=0.05)
    stated = estimate(study.changed(n_sub=1))
    assert stated.status not in (FitStatus.CONVERGED, FitStatus.NO_PROGRESS)
