"""A stop whose contact has a loss: a form of the end stop, from where the lossless one ended."""

from __future__ import annotations

import numpy as np

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.laws import HuntCrossley
from bondgraph.signals.recording import Split
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.screening.observation import scene
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem

M, D, K = 0.8, 3.0, 400.0
STOP, HIGH, LOSS = 6e3, 0.02, 1.5
DT, N, FINE = 4e-3, 400, 80


def stage() -> BondGraph:
    with BondGraph("stage") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", M, unit="kg", spread=1.05)
        body >> R("d", D, unit="N*s/m", spread=1.5)
        body >> C("k", stiffness=K, unit="N/m", spread=1.2)
        body >> Dq("x", unit="m")
    return g


def recorded() -> Data:
    """A stage against its upper stop, by the Verlet method, read with noise."""

    def push(t: float) -> float:
        return 12.0 * float(np.sin(14.5 * t)) + 6.0 * float(np.sin(23.2 * t + 1.0) - np.sin(1.0))

    h, x, v, found = DT / FINE, 0.0, 0.0, []
    for k in range(N * FINE):
        if k % FINE == 0:
            found.append(x)
        x += h / 2 * v
        depth = max(x - HIGH, 0.0)
        force = push((k + 0.5) * h) - K * x - D * v - STOP * depth * (1.0 + LOSS * v)
        v += h * force / M
        x += h / 2 * v
    way = np.array(found)
    assert way.max() > HIGH + 1e-3
    level = 0.005 * float(way.std())
    y = (way + level * np.random.default_rng(4).standard_normal(N))[:, None]
    t = DT * np.arange(N)
    split = Split(slice(0, N), slice(N, N), "all")
    command = {"F": np.array([push(s) for s in t])}
    return Data("blows", t, command, y, ("x",), np.array([level]), split, hold="linear")


def test_a_loss_in_the_contact_is_a_form_of_the_stop() -> None:
    data, effect = recorded(), by_name("end_stop")
    seen = scene(fit(Problem(stage(), data), max_iterations=8))
    lossless = effect.insert(seen, seen.graph["k"])
    start = {"k_s_k": STOP, "low_k": -0.1, "high_k": HIGH}
    ended = fit(Problem(lossless.graph, data, starts=start, n_sub=4), max_iterations=12)
    assert effect.forms(seen, seen.graph["k"], {}) == ()
    (form,) = effect.forms(seen, seen.graph["k"], {"end_stop": ended.values})
    assert form.law == HuntCrossley.name
    found = fit(Problem(form.graph, data, starts=dict(form.starts[0]), n_sub=4), max_iterations=20)
    assert found.cost < 0.3 * ended.cost
    assert abs(found.values["loss_k"] / LOSS - 1.0) < 0.2
    (again,) = effect.refinements(scene(ended), ended.problem.graph["k"], ended.values)
    assert (again.law, again.form) == (HuntCrossley.name, True)
    assert abs(found.values["high_k"] / HIGH - 1.0) < 0.02
