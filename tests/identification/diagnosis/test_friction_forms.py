"""Richer forms of friction: inserted where a simple law ended, kept only where they are needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bondgraph.laws import DahlFriction, FrictionAlongWay, FrictionUnderLoad, Law, LuGre
from bondgraph.simulation.simulate import exact_form
from identification.diagnosis.catalogue import Insertion, by_name
from identification.diagnosis.catalogue.friction.forms import FRICTION_FORMS
from identification.diagnosis.evidence.hypotheses import Scored, Thresholds
from identification.diagnosis.search.candidates import attempt, go_on
from identification.diagnosis.search.one_step import best_form, scored
from identification.estimation.single_record import fit
from identification.study.problem import Problem
from tests.identification.diagnosis.effect_plants import response, scene

SIMPLE = ("coulomb_friction", "stribeck_friction", "presliding_friction")
FRICTION = Mapping[str, Mapping[str, float]]
ENDED: FRICTION = {
    "presliding_friction": {"m": 1.3, "k": 30.0, "d": 0.9, "F_c_d": 2.0, "delta_d": 0.05},
    "stribeck_friction": {"m": 1.2, "F_c_d": 1.8, "F_d_d": 0.7, "f_s_d": 0.3},
}


def forms(ended: FRICTION) -> dict[str, Insertion]:
    s = scene("mechanical")
    made = by_name("coulomb_friction").forms(s, s.graph["d"], ended)
    return {f"{m.law} {m.graph['d'].law.watched}".strip(): m for m in made}  # type: ignore[attr-defined]


def test_every_simple_law_of_friction_has_the_same_forms() -> None:
    s = scene("mechanical")
    for name in SIMPLE:
        laws = {m.law for m in by_name(name).forms(s, s.graph["d"], ENDED)}
        assert laws == set(FRICTION_FORMS)
    assert by_name("quadratic_drag").forms(s, s.graph["d"], {}) == ()


@pytest.mark.parametrize("name", list(forms(ENDED)))
def test_forms_start_where_simple_laws_ended_and_vanish(name: str) -> None:
    form, quiet = forms(ENDED)[name], response(scene("mechanical").graph, "mechanical", {})
    assert form.graph.check() == ()
    compiled = exact_form(form.graph)
    assert compiled is not None
    assert set(form.strengths) <= set(compiled.parameter_names)
    assert form.effect in SIMPLE
    assert form.family == "friction"
    assert {start["m"] for start in form.starts} == {1.3, 1.2}
    known = form.graph.parameters
    for start in form.starts:
        for n, v in start.items():
            low, high = known[n].lower, known[n].upper
            assert low is None or v >= low, n
            assert high is None or v <= high, n
        assert form.is_itself(start)
        assert np.isfinite(response(form.graph, "mechanical", start, 1e-2)).all()
    nothing = dict.fromkeys(form.strengths, 1e-9)
    absent = response(form.graph, "mechanical", nothing, 1e-3)
    np.testing.assert_allclose(absent, quiet, atol=1e-5 * np.abs(quiet).max())


def plants(law: Law, values: Mapping[str, float], n: int = 800) -> Any:
    """Return data of the mechanical plant with a law in its damper, without it in the model."""
    s = scene("mechanical")
    graph = s.graph.with_element("d", law=law)
    clean = response(graph, "mechanical", values, 1e-5)
    noise = 1e-3 * clean.std(axis=0)
    readings = clean + noise * np.random.default_rng(4).normal(size=clean.shape)
    return replace(s.data, readings=readings, floor=noise)


def fits(law: Law, values: Mapping[str, float], wanted: str, simple: str) -> tuple[Scored, ...]:
    """Fit a simple law and one richer form of it from where that ended; the simple one first."""
    data = plants(law, values)
    s = replace(scene("mechanical"), data=data)
    plain = fit(Problem(s.graph, data), max_iterations=8)
    s = replace(s, nominal=plain)
    begun = by_name(simple).insert(s, s.graph["d"])
    _, first = attempt(begun, True, replace(plain.problem, graph=begun.graph, built=None))
    assert first is not None
    first = go_on(first, 12)[1]
    assert first is not None
    made = by_name(simple).forms(s, s.graph["d"], {simple: first.fit.values})
    found = []
    for form in made:
        if form.law == wanted:
            _, t = attempt(form, True, replace(plain.problem, graph=form.graph, built=None))
            assert t is not None
            found.append(go_on(t, 14)[1])
    trials = [first, *(t for t in found if t is not None)]
    by_trial = {id(x.trial): x for x in scored(trials)}
    return tuple(by_trial[id(t)] for t in trials)


NEEDED: list[tuple[Law, dict[str, float], str, str, dict[str, float]]] = [
    (LuGre(2.0, 1.5, 0.15, 40.0, 0.8), {}, "lugre", "presliding_friction",
     {"F_c_d": 2.0, "sigma_0_d": 40.0}),
    (FrictionAlongWay("q_k", 2.0, 0.1, 0.8), {"F_1_d": 0.6, "F_2_d": 1.2}, "coulomb_along_way",
     "coulomb_friction", {}),
    (FrictionUnderLoad("e_k", 0.5, 0.12), {"mu_2_d": 0.03}, "coulomb_under_load",
     "coulomb_friction", {"mu_1_d": 0.12, "mu_2_d": 0.03, "F_c_d": 0.5}),
]  # fmt: skip


@pytest.mark.parametrize(
    ("law", "values", "wanted", "simple", "truth"), NEEDED, ids=[n[2] for n in NEEDED]
)
def test_a_form_that_is_needed_reaches_the_noise(
    law: Law, values: dict[str, float], wanted: str, simple: str, truth: dict[str, float]
) -> None:
    first, *richer = fits(law, values, wanted, simple)
    chosen = best_form(richer, first, Thresholds())
    assert chosen is not None
    assert chosen.trial.insertion.law == wanted
    assert first.left.most > 1.5 > chosen.left.most
    assert chosen.trial.train < 1.5
    for name, value in truth.items():
        assert chosen.trial.fit.values[name] == pytest.approx(value, rel=0.1)


def test_a_form_that_is_not_needed_is_not_taken() -> None:
    first, *richer = fits(DahlFriction(2.0, 0.05), {}, "lugre", "presliding_friction")
    assert richer
    assert best_form(richer, first, Thresholds()) is None
