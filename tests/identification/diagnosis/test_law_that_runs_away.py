"""A law that is begun too strong may take the model where no fit leads back from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph.laws import Polynomial
from bondgraph.signals.split import interleaved
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.base import base_of
from identification.diagnosis.search.beginnings import promising
from identification.diagnosis.search.candidates import attempt, go_on
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.single_record import start_cost
from identification.study.data import Data
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 1200, 0.005, 2e-6
SOFTER = -2.0e4
"""Cubic stiffness of the true spring, N/m^3."""
STRONG = -10.0
"""The same over the stiffness at the end of the way: no spring is left there."""


def softening() -> Data:
    t = DT * np.arange(N)
    force = 2 * np.sin(2 * np.pi * 0.7 * t) + np.sin(2 * np.pi * 1.9 * t)
    truth = spring().with_element("k", law=Polynomial(orders=(3,), size=1.0))
    x = simulate(truth, t, {"F": force}, {"a_3_k": SOFTER})["x"]
    noise = NOISE * np.random.default_rng(3).standard_normal(N)
    return Data(
        "run", t, {"F": force}, (x + noise)[:, None], ("x",), np.array([NOISE]), interleaved(0, N),
        "linear",
    )  # fmt: skip


@pytest.mark.parametrize("rebalanced", [False, True])
def test_a_law_that_is_begun_too_strong_is_begun_weaker(rebalanced: bool) -> None:
    _, nominal = nominal_fit(spring(), softening(), "linear")
    seen, template = scene(nominal), base_of(nominal).template
    made = by_name("nonlinear_stiffness").insert(seen, seen.graph["k"])
    strong = dict.fromkeys(made.strengths, 0.0) | {"a_3_k": STRONG}
    # a start may change the rest of the model to suit a law that strong
    beside = {"k": 1.3 * nominal.values["k"]}
    made = replace(made, starts=({**strong, **beside}, strong) if rebalanced else (strong,))
    problem = replace(template, graph=made.graph, built=None)
    assert promising(problem, made, far=False) == []
    assert attempt(made, True, problem, far=False)[1] is None
    plain = start_cost(template)
    (weaker,) = promising(problem, made, far=False, plain=plain)
    assert STRONG < weaker.starts["a_3_k"] < 0.0
    assert weaker.starts["k"] == nominal.values["k"]
    _, found = attempt(made, True, problem, far=False, plain=plain)
    assert found is not None
    assert found.train < nominal.chi2("train")
    _, found = go_on(found, 20)
    assert found is not None
    assert found.fit.values["a_3_k"] < 0.0
    assert found.train < 1.2


def test_a_law_that_does_nothing_is_no_start() -> None:
    _, nominal = nominal_fit(spring(), softening(), "linear")
    seen, template = scene(nominal), base_of(nominal).template
    made = by_name("contact_loss").insert(seen, seen.graph["k"])
    (strength,) = made.strengths
    never = {**made.starts[0], strength: 0.0, "k": 9.0 * nominal.values["k"]}
    problem = replace(template, graph=made.graph, built=None)
    begun = promising(problem, replace(made, starts=(never,)), False, start_cost(template))
    assert [p.starts["k"] for p in begun] == [never["k"]]
