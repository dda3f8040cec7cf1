"""A damper that is steep when slow and flat when fast, and differs between both directions."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from bondgraph.laws import Coulomb, DigressiveDamping
from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.catalogue.friction.asymmetric_damping import AsymmetricDampingEffect
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.explanation.law_formula import in_symbols
from identification.diagnosis.search.candidates import Candidate, DiagnosisOptions
from identification.estimation.single_record import fit, start_cost
from identification.study.problem import Problem
from tests.identification.diagnosis.effect_plants import response, scene
from tests.settled import simulate
from tests.spring import spring

TRUTH = {"d": 6.0, "d_a_d": -2.5, "f_d_d": 0.6}


def test_its_form_leaves_noise_where_two_slopes_do_not() -> None:
    seen, effect = scene("mechanical"), AsymmetricDampingEffect()
    damper = seen.graph["d"]
    true = seen.graph.with_element("d", law=DigressiveDamping(coefficient="d", stiffness=6.0))
    clean = response(true, "mechanical", TRUTH, 1e-5)
    noise = 1e-3 * clean.std(axis=0)
    readings = clean + noise * np.random.default_rng(4).normal(size=clean.shape)
    data = replace(seen.data, readings=readings, floor=noise)

    plain = effect.insert(seen, damper, Hint({}, np.array([-0.3])))
    two = fit(Problem(plain.graph, data, starts=plain.starts[0], n_sub=2), max_iterations=40)
    assert two.chi2("train") > 100

    (form,) = effect.forms(seen, damper, {})
    assert (form.law, form.form, form.strengths) == ("digressive_damping", True, ("d_a_d",))
    posed = [Problem(form.graph, data, starts=start, n_sub=4) for start in form.starts]
    found = fit(min(posed, key=start_cost), max_iterations=40)
    assert found.chi2("train") < 1.2
    own = {e.name: e for e in found.estimates}
    for name, truth in TRUTH.items():
        low, high = own[name].ci95
        assert low < truth < high, name


def test_its_formula_is_written_without_the_straight_line() -> None:
    seen = scene("mechanical")
    (form,) = AsymmetricDampingEffect().forms(seen, seen.graph["d"], {})
    held: Any = SimpleNamespace(problem=SimpleNamespace(graph=form.graph))
    said = in_symbols(Candidate(form, True, held, 1.0, 1.0, np.ones(1)))
    assert said == "force of d = (d*v + d_a_d*|v|)/(1 + |v|/f_d_d), where v is the velocity of d"


def test_a_damper_that_is_as_steep_either_way_is_no_uneven_one() -> None:
    """Without the laws of friction a flat damper stood for them, uneven by name."""
    t = np.asarray(0.01 * np.arange(1200), np.float64)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 3 * np.sin(2 * np.pi * 2.3 * t)
    rubbing = simulate(spring().with_element("d", law=Coulomb(0.5)), t, {"F": u})
    x = rubbing["x"] + 1e-5 * np.random.default_rng(1).standard_normal(t.size)
    recording = Recording("run", t, {"F": u, "x": x}, {"F": "N", "x": "m"})
    away = ("coulomb_friction", "stribeck_friction", "presliding_friction")
    options = DiagnosisOptions(jobs=1, keep=1, more=2, effects=1, without=away)
    found = diagnose(spring(), recording, options=options)
    assert found.kind == "unknown_physics"
    assert [s.physics for s in found.findings] == ["dissipative"]
