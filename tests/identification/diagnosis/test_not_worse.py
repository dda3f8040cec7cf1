"""A law that contains another explains at least as much, or its fit stopped too early."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.laws import Stribeck
from bondgraph.signals.split import interleaved
from identification.diagnosis.catalogue import Insertion, by_name
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.candidates import (
    Candidate,
    DiagnosisOptions,
    _simpler_ended,
    not_worse,
    trial_of,
)
from identification.diagnosis.search.nominal import nominal_fit
from identification.diagnosis.search.one_step import BEHIND, _finished
from identification.diagnosis.search.scored_laws import _idle
from identification.estimation.single_record import fit
from identification.estimation.sub_steps import settled_fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 1500, 0.005, 2e-6
OPTIONS = DiagnosisOptions(jobs=1)


def rubbing() -> Data:
    t = DT * np.arange(N)
    force = 3 * np.sin(2 * np.pi * 0.7 * t) + 2 * np.sin(2 * np.pi * 1.9 * t)
    truth = spring().with_element("d", law=Stribeck(0.5, 0.3, 0.02))
    x = simulate(truth, t, {"F": force})["x"] + NOISE * np.random.default_rng(2).standard_normal(N)
    return Data(
        "run", t, {"F": force}, x[:, None], ("x",), np.array([NOISE]), interleaved(0, N), "linear"
    )


@cache
def candidates() -> tuple[Problem, tuple[Candidate, ...]]:
    """Coulomb friction fitted, Stribeck's and a hysteresis hardly begun."""
    template, nominal = nominal_fit(spring(), rubbing(), "linear")
    seen, made = scene(nominal), []
    for name, place in (("coulomb_friction", "d"), ("stribeck_friction", "d"), ("hysteresis", "k")):
        i = by_name(name).insert(seen, seen.graph[place])
        begin = {**template.starts, **i.starts[0]}
        problem = replace(template, graph=i.graph, built=None, starts=begin)
        done = settled_fit(problem, 20) if name[0] == "c" else fit(problem, max_iterations=0)
        made.append(trial_of(i, True, done))
    return template, tuple(made)


def held(effect: str, element: str, **ends: tuple[float, float]) -> Any:
    """A fitted law of which only the intervals of its strengths are known."""
    fitted = SimpleNamespace(
        estimates=[SimpleNamespace(name=n, ci95=e) for n, e in ends.items()],
        problem=SimpleNamespace(graph=SimpleNamespace(parameters=dict.fromkeys(ends))),
    )
    e, nothing = by_name(effect), cast(BondGraph, None)
    insertion = Insertion(
        effect, e.family, e.law, element, nothing, (), tuple(ends), e.simpler, (), "", e.kind
    )
    return SimpleNamespace(effect=effect, element=element, fit=fitted, insertion=insertion)


def test_a_part_that_may_be_zero_says_nothing_where_all_may() -> None:
    """Only ratios of masses, springs and forces show: every interval then reaches zero."""
    sure, open_ = (0.4, 0.6), (-3.0, 4.0)
    for level, drop, idle in ((sure, open_, True), (sure, sure, False), (open_, open_, False)):
        coulomb = held("coulomb_friction", "d", F_c=level)
        stribeck = held("stribeck_friction", "d", F_c=level, F_d=drop)
        assert _idle(stribeck, [coulomb, stribeck]) is idle
        assert not _idle(coulomb, [coulomb, stribeck])


def test_a_law_that_is_hardly_worse_than_one_it_contains_is_fitted_again() -> None:
    """Sticking at no Stribeck part, a few tenths of a percent behind what it contains."""
    _, (coulomb, stribeck, _) = candidates()
    hardly = replace(stribeck, fit=coulomb.fit, train=1.004 * coulomb.train)
    assert _simpler_ended(hardly, [coulomb, hardly]) is coulomb.fit
    equal = replace(hardly, train=coulomb.train)
    assert _simpler_ended(equal, [coulomb, equal]) is None


def test_the_richer_law_goes_on_from_where_the_simpler_ended() -> None:
    _, (coulomb, stribeck, hysteresis) = candidates()
    assert stribeck.train > 2 * coulomb.train
    again = not_worse([coulomb, stribeck, hysteresis], OPTIONS)
    assert again[0] is coulomb
    assert again[2] is hysteresis  # holds nothing else as a special case
    assert again[1].train < 0.5 * coulomb.train
    assert (again[1].effect, again[1].element, again[1].home) == ("stribeck_friction", "d", True)
    # what explains at least as much is left alone
    assert not_worse(again, OPTIONS)[1] is again[1]


def test_what_was_on_its_way_is_followed_where_the_best_leaves_more_than_noise() -> None:
    _, (coulomb, stribeck, hysteresis) = candidates()
    assert coulomb.train > 1.5**2
    assert 1.5 * coulomb.train < stribeck.train < BEHIND * coulomb.train
    trials = [coulomb, stribeck, hysteresis]
    followed = {t.effect: t for t in _finished(trials, OPTIONS, 1.5)}
    assert followed["stribeck_friction"].train < 0.6 * coulomb.train
    # beside a law that leaves noise nothing else is worth the time
    left = _finished(trials, OPTIONS, 2 * float(np.sqrt(coulomb.train)))
    assert any(t is stribeck for t in left)


def test_a_law_that_the_best_is_confused_with_is_fitted_to_its_end() -> None:
    """At the noise nothing else is followed; but none is out of question before its end."""
    _, (coulomb, stribeck, hysteresis) = candidates()
    noise = 2 * float(np.sqrt(coulomb.train))
    named = replace(
        coulomb, insertion=replace(coulomb.insertion, confused_with=(stribeck.effect,), simpler=())
    )
    alone = replace(stribeck, insertion=replace(stribeck.insertion, confused_with=(), simpler=()))
    begun = replace(alone, train=2 * coulomb.train)
    followed = {t.effect: t for t in _finished([named, begun, hysteresis], OPTIONS, noise)}
    assert followed["stribeck_friction"].train < begun.train
    assert followed["hysteresis"].train == hysteresis.train
