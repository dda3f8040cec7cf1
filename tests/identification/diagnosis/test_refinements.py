"""A law that is named may turn out richer: the repaired model changes, what was named does not."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.laws import Coulomb, GrowingDamping, LawSum, Polynomial
from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue import CATALOGUE, by_name
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.report.changed import definition, math_svg
from identification.diagnosis.report.sections import law as law_section
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.base import base_of
from identification.diagnosis.search.candidates import DiagnosisOptions, fitted_insertions
from identification.diagnosis.search.refining import refined
from identification.diagnosis.verdict import retold, sentence, verdict
from tests.settled import simulate
from tests.spring import spring

KEPT = ("nonlinear_stiffness", "bilinear_stiffness", "quadratic_drag", "coulomb_friction")
OPTIONS = DiagnosisOptions(
    jobs=1, effects=2, holds=("linear",),
    without=tuple(e.name for e in CATALOGUE if e.name not in KEPT),
)  # fmt: skip
TRUE = {"a_2_k": 0.5, "a_3_k": 3.0}


def plant() -> BondGraph:
    law = LawSum((Polynomial(0.0, 0.1, 10.0), GrowingDamping(0.02)))
    return spring().with_element("k", law=law)


@cache
def found(gamma: float, friction: float = 0.0) -> Diagnosis:
    """Diagnose the plant; without friction a second effect is looked for beside its spring."""
    t = np.asarray(0.01 * np.arange(800), np.float64)
    f, rng = np.arange(0.5, 6.0, 0.13), np.random.default_rng(1)
    u = 1.2 * np.sin(2 * np.pi * np.outer(t, f) + rng.uniform(0, 6, f.size)).sum(axis=1)
    true, values = plant(), {**TRUE, "gamma_k": gamma}
    if friction:
        true = true.with_element("d", law=Coulomb(friction))
    run = simulate(true, t, {"F": u}, values, accuracy=1e-6)
    x = np.asarray(run["x"])
    x = x + 1e-3 * x.std() * rng.standard_normal(t.size)
    recording = Recording("run", t, {"F": u, "x": x}, {"F": "N", "x": "m"})
    return diagnose(spring(), recording, options=replace(OPTIONS, effects=1 if friction else 2))


def test_a_named_spring_gets_the_loss_that_it_has() -> None:
    d = found(60.0)
    said = verdict(d)["findings"][0]
    assert (said["effect"], said["location"]["element"]) == ("nonlinear_stiffness", "k")
    assert (said["kind"], said["law"]) == ("restoring", "polynomial_with_loss")
    own = {p["name"]: (p["value"], p["unit"]) for p in said["parameters"]}
    assert own["gamma_k"] == (pytest.approx(60.0, rel=0.03), "N*s/m3")
    assert own["rest_k"] == (pytest.approx(0.02, abs=1e-3), "m")
    assert "with a loss that follows the bend" in sentence(d)
    assert "Its fitted law: polynomial with loss." in retold(verdict(d))
    shown = law_section(d)
    assert "gamma_k" in shown
    assert "Law: polynomial with loss." in shown
    chosen = d.findings[0].chosen
    assert chosen is not None
    assert r"\gamma" in definition(chosen)[0]
    assert math_svg(definition(chosen)[0], "law")
    plain = next(t for t in d.trials if t.label == "nonlinear_stiffness at k")
    assert d.repaired is not None
    assert plain.train > 4.0 * d.repaired.chi2("train")
    assert d.left is not None
    assert d.left.most < 1.2
    graph = d.study.graph
    assert from_json(to_json(graph))["k"] == graph["k"]


def test_a_spring_without_a_loss_keeps_its_law() -> None:
    d = found(0.0)
    (step,) = d.findings
    assert step.chosen is not None
    assert step.chosen.insertion.law == "polynomial"
    assert "gamma_k" not in d.study.graph.parameters


def test_what_was_decided_is_left_as_it_is() -> None:
    """Law, fit and what it leaves may change, and only where it surely predicts more."""
    d = found(60.0)
    (step,) = d.findings
    assert step.chosen is not None
    plain = next(t for t in step.trials if t.label == "nonlinear_stiffness at k")
    before = replace(step, chosen=plain)
    (after,) = refined([before], OPTIONS, Thresholds())
    assert after.chosen is not None
    assert after.chosen.insertion.law == "polynomial_with_loss"
    for field in fields(after):
        if field.name not in ("chosen", "remaining"):
            assert getattr(after, field.name) is getattr(before, field.name)
    assert (after.chosen.effect, after.chosen.element) == (plain.effect, plain.element)
    # nothing is asked for where noise is left, or where no refinement can be that sure
    assert refined([after], OPTIONS, Thresholds()) == (after,)
    for limits in (Thresholds(noise=1e3), Thresholds(z=1e3)):
        assert refined([before], OPTIONS, limits) == (before,)
    unknown = replace(before, kind="unknown_physics")
    assert refined([unknown], OPTIONS, Thresholds()) == (unknown,)


@pytest.mark.long
def test_an_effect_that_was_named_before_another_is_refined_beside_it() -> None:
    """Its new numbers are its own in the verdict, not those of the last finding."""
    d = found(60.0, 0.3)
    step = d.steps[0]
    plain = next(t for t in step.trials if t.label == "nonlinear_stiffness at k")
    seen = scene(plain.fit)
    friction = by_name("coulomb_friction").insert(seen, seen.graph["d"])
    template = base_of(plain.fit).template
    (last,) = fitted_insertions(seen, template, [(friction, True)], OPTIONS)
    both = [replace(step, chosen=plain), replace(step, chosen=last)]
    said = verdict(replace(d, steps=refined(both, OPTIONS, Thresholds())))
    first, second = said["findings"]
    assert (first["law"], second["law"]) == ("polynomial_with_loss", "coulomb")
    assert {p["name"] for p in first["parameters"]} == {"a_2_k", "a_3_k", "gamma_k", "rest_k"}
    assert {p["name"] for p in second["parameters"]} == {"F_c_d"}


def test_what_a_plain_law_leaves_is_no_second_effect() -> None:
    d = found(60.0)
    assert [s.chosen.label for s in d.findings if s.chosen] == ["nonlinear_stiffness at k"]
    assert d.left is not None
    assert d.left.most < 1.2
