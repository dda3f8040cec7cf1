"""The first samples of a long record choose where the fit of a law begins."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bondgraph.laws import Polynomial
from bondgraph.signals.split import interleaved
from identification.diagnosis.catalogue import Insertion, by_name
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search import candidates
from identification.diagnosis.search.base import base_of
from identification.diagnosis.search.beginnings import best_first, promising, tells_early
from identification.diagnosis.search.candidates import attempt, go_on
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation import brief
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 1200, 0.005, 2e-6


@pytest.fixture(autouse=True)
def long(monkeypatch: pytest.MonkeyPatch) -> None:
    """Records of this page count as long ones."""
    monkeypatch.setattr(brief, "BRIEF", N // 2)


def hardening(late: bool = False) -> Data:
    """A spring that hardens; with little force in the first half if `late`."""
    t = DT * np.arange(N)
    force = 2 * np.sin(2 * np.pi * 0.7 * t) + np.sin(2 * np.pi * 1.9 * t)
    force *= np.where(t < t[N // 2], 0.02, 1.0) if late else 1.0
    truth = spring().with_element("k", law=Polynomial(orders=(3,), size=1.0))
    x = simulate(truth, t, {"F": force}, {"a_3_k": 4e4})["x"]
    x = x + NOISE * np.random.default_rng(3).standard_normal(N)
    return Data(
        "run", t, {"F": force}, x[:, None], ("x",), np.array([NOISE]), interleaved(0, N), "linear"
    )


def begun() -> tuple[Insertion, Problem]:
    nominal = nominal_fit(spring(), hardening(), "linear")[1]
    seen, template = scene(nominal), base_of(nominal).template
    made = by_name("nonlinear_stiffness").insert(seen, seen.graph["k"])
    return made, replace(template, graph=made.graph, built=None)


def test_the_best_start_comes_first_with_where_it_ended() -> None:
    made, problem = begun()
    starts = promising(problem, made)
    assert len(starts) > 1
    (best, point), *others = best_first(starts)
    assert point is not None
    assert {id(best), *(id(p) for p, _ in others)} == {id(p) for p in starts}
    assert all(at is None for _, at in others)
    assert fit(best, start=point, max_iterations=0).cost < 2 * min(fit(p).cost for p in starts)


def test_it_leads_where_all_starts_lead() -> None:
    made, problem = begun()
    ends = []
    for early in (False, True):
        found = attempt(made, True, problem, early=early)[1]
        assert found is not None
        found = go_on(found, 20)[1]
        assert found is not None
        ends.append(found.train)
    assert ends[1] == pytest.approx(ends[0], rel=0.01)
    assert ends[1] < 1.2


def test_others_are_tried_where_the_best_runs_away_later(monkeypatch: pytest.MonkeyPatch) -> None:
    made, problem = begun()

    def running_away(p: Problem, **given: Any) -> Fit:
        if given.get("start") is not None:
            raise np.linalg.LinAlgError("not finite")
        return fit(p, **given)

    monkeypatch.setattr(candidates, "fit", running_away)
    assert attempt(made, True, problem, early=True)[1] is not None


def test_a_beginning_without_its_share_of_the_misfit_tells_nothing() -> None:
    assert tells_early(nominal_fit(spring(), hardening(), "linear")[1])
    assert not tells_early(nominal_fit(spring(), hardening(late=True), "linear")[1])


def test_a_start_with_declared_values_begins_from_the_declared_state() -> None:
    """What a large effect has bent are initial states and offsets as well as parameters."""
    made, problem = begun()
    assert problem.known_states
    near, far = (promising(problem, made, far=f) for f in (False, True))
    assert all(p.known_states for p in near)
    *bent, plainly = far
    assert all(p.known_states for p in bent)
    assert (plainly.known_states, plainly.known_offsets) == ({}, ())
    offsets = replace(problem, source_offsets=True)  # one that integrates is known from windows
    assert all(p.known_states for p in promising(offsets, made, far=True))
