"""A dead time of the command looks like delays of all sensors: the verdict says so."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.graph.drives import Drive
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.recording import Recording, Split
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.advice import advice
from identification.diagnosis.explanation.common_lag import common_lag, lag_of_all
from identification.diagnosis.verdict.text import sentence
from identification.estimation.leaning import leanings
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate
from tests.spring import spring

N, DT = 1200, 0.01


def model() -> BondGraph:
    return spring(m=0.2, d=6.0, speed="v")


def fitted(late: float, beside: float = 0.0) -> Fit:
    """A lag `late` of the force, `beside` of the speed's sensor alone."""
    t = DT * np.arange(N)
    u = sum(a * np.sin(f * t + f) for a, f in ((8.0, 1.3), (6.0, 5.1), (5.0, 17.0), (4.0, 31.0)))
    true = model().with_parameters([Parameter("late", late, "s", positive=False)])
    true = true.with_element("F", drive=Drive(delay="late"))
    run = simulate(true, t, {"F": u}, x0=np.zeros(2))
    y = np.stack([run["x"], np.interp(t - beside, t, run["v"])], axis=1)
    floor = 2e-3 * y.std(axis=0)
    y = y + floor * np.random.default_rng(2).standard_normal(y.shape)
    split = Split(slice(0, N // 2), slice(N // 2, N), "first half")
    data = Data("run", t, {"F": u}, y, ("x", "v"), floor, split)
    return fit(Problem(model(), data), max_iterations=20)


def diagnosis(made: Fit) -> Diagnosis:
    run = Recording("run", made.problem.data.time, {"v": np.zeros(N)}, {"v": "m/s"})
    return Diagnosis("parameters_only", "spring", run, model(), made.problem.data, nominal=made)


def test_answer_and_advice_name_the_lag_of_the_command() -> None:
    d = diagnosis(fitted(2.5e-3))
    lag = lag_of_all(d)
    assert lag is not None
    assert (set(lag.delays), lag.commands) == ({"delay x", "delay v"}, ("F",))
    assert lag.seconds == pytest.approx(2.5e-3, rel=0.05)
    assert sentence(d).endswith("is what a dead time or a quick low pass of F would do.")
    assert lag.advice in advice(d, np.array([1.0]))
    assert "10 ms lie between samples" in lag.advice


def test_delays_that_differ_are_those_of_the_sensors() -> None:
    assert lag_of_all(diagnosis(fitted(0.0, beside=2.5e-3))) is None
    made = leanings(fitted(2.5e-3))
    other = replace(made[0], estimate=replace(made[0].estimate, value=5e-3, ci95=(4.9e-3, 5.1e-3)))
    assert common_lag((other, *made[1:]), ("x", "v"), ("F",), DT) is None
    assert common_lag(made, ("x", "v", "a"), ("F",), DT) is None
    ends: dict[str, Any] = {"value": -2e-3, "ci95": (-3e-3, -1e-3)}
    early = [replace(n, estimate=replace(n.estimate, **ends)) for n in made]
    found = common_lag(early, ("x", "v"), ("F",), DT)
    assert found is not None
    assert "come 2 ms before" in found.claim
