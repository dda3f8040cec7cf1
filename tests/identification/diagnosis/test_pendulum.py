"""A pendulum that swings wide: its model has the stiffness m g l, the torque follows the sine."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.signals.recording import Split
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem

J, B, MGL = 0.08, 0.012, 1.962
DT, N, FINE = 0.02, 700, 8


def pendulum(unit: str = "N*m/rad") -> BondGraph:
    with BondGraph("pendulum") as g:
        pivot = One("pivot")
        Se("M", unit="N*m") >> pivot >> I("J", J, unit="kg*m2", spread=1.05)
        pivot >> R("b", B, unit="N*m*s/rad", spread=2.0)
        pivot >> C("k", stiffness=MGL, unit=unit, spread=1.2)
        pivot >> Dq("phi", unit="rad")
    return g


@cache
def seen() -> FittedModel:
    """A swing of 85 degrees by classical Runge-Kutta, read by a potentiometer."""
    h = DT / FINE

    def push(t: float) -> float:
        return 0.3 * float(np.sin(2 * np.pi * (0.5 + 0.015 * t) * t))

    def rate(x: np.ndarray, t: float) -> np.ndarray:
        return np.array([x[1], (push(t) - B * x[1] - MGL * np.sin(x[0])) / J])

    x, found = np.zeros(2), []
    for k in range(N * FINE):
        if k % FINE == 0:
            found.append(x[0])
        t = k * h
        a = rate(x, t)
        b = rate(x + h / 2 * a, t + h / 2)
        c = rate(x + h / 2 * b, t + h / 2)
        d = rate(x + h * c, t + h)
        x = x + h / 6 * (a + 2 * b + 2 * c + d)
    way = np.array(found)
    assert 75.0 < np.degrees(np.abs(way).max()) < 115.0
    level = 0.005 * float(way.std())
    y = (way + level * np.random.default_rng(2).standard_normal(N))[:, None]
    time = DT * np.arange(N)
    command = {"M": np.array([push(v) for v in time])}
    split = Split(slice(0, N), slice(N, N), "all")
    data = Data("swing", time, command, y, ("phi",), np.array([level]), split, hold="linear")
    return scene(fit(Problem(pendulum(), data), max_iterations=10))


def test_the_torque_of_a_weight_is_a_form_of_a_bent_stiffness() -> None:
    made = by_name("nonlinear_stiffness").forms(seen(), seen().graph["k"], {})
    (form,) = made
    assert (form.law, form.kind) == ("gravity", "restoring")
    data = seen().nominal.problem.data
    tried = (fit(Problem(form.graph, data, starts=dict(s))) for s in form.starts)
    best = min(tried, key=lambda f: f.cost)
    assert best.chi2("train") < 1.3
    assert best.values["k"] == pytest.approx(MGL, rel=0.02)
    assert best.values["T_g_k"] == pytest.approx(MGL, rel=0.05)


def test_only_what_turns_may_be_a_weight() -> None:
    straight = pendulum("N/m")
    assert by_name("nonlinear_stiffness").forms(seen(), straight["k"], {}) == ()


def test_a_softening_torque_says_what_may_soften_it() -> None:
    effect = by_name("nonlinear_stiffness")
    for weight, says in ((-0.3, True), (0.3, False)):
        hint = Hint({}, np.array([0.0, weight]))
        made = effect.insert(seen(), seen().graph["k"], hint)
        assert ("sin(angle)" in made.sentence) is says
