"""Hysteresis that creeps, saturates, widens or hardens: its form is told, and only if due."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, One, R, Zero
from bondgraph.graph.drives import Drive
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import BoucWenMemory, LawSum, Polynomial, StopSum
from bondgraph.signals.recording import Recording, Split
from bondgraph.simulation.lure import exact_form
from identification.diagnosis.catalogue import CATALOGUE, Insertion, by_name
from identification.diagnosis.catalogue.places import law_of
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.hypotheses import Scored, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.leave_out import LeftOut, Rows
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.search.base import base_of
from identification.diagnosis.search.candidates import (
    DiagnosisOptions,
    finished,
    fitted,
    fitted_insertions,
)
from identification.diagnosis.search.looks import Looks
from identification.diagnosis.search.richer_laws import best_form, of_told_kind
from identification.diagnosis.search.scored_laws import scored
from identification.diagnosis.search.task import SearchTask
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate
from tests.spring import spring

N, DT = 900, 0.02
STOPS = StopSum((0.009, 0.018, 0.045), height=40.0)


def plain() -> BondGraph:
    return spring(m=0.2, d=6.0)


def with_law(law: Any) -> BondGraph:
    return plain().with_element("k", law=law)


def creeping() -> BondGraph:
    g = with_law(STOPS)
    (bond,) = g.bonds_of("k")
    g = g.with_inserted(bond, Zero("node"))
    for j, (amount, tau) in enumerate(((0.15, 0.4), (0.2, 4.0)), start=1):
        g = g.with_branch("node", [One(f"b_{j}")])
        g = g.with_branch(f"b_{j}", [C(f"C_{j}", stiffness=200.0 / amount)])
        g = g.with_branch(f"b_{j}", [R(f"R_{j}", 200.0 * tau / amount)])
    return g


def saturating() -> BondGraph:
    g = with_law(LawSum((STOPS, Polynomial(0.0, 0.1, 1.0, (3, 5)))))
    return g.with_values({"a_3_k": 2.0, "a_5_k": 3.0})


def widening() -> BondGraph:
    rated = StopSum(STOPS.thresholds, height=40.0, rated=True, speed=0.3)
    return with_law(rated).with_values({"b_k": 1.5})


def stopping() -> BondGraph:
    return with_law(STOPS)


@cache
def found(
    plant: Callable[[], BondGraph],
) -> tuple[Scored, Scored | None, FittedModel, tuple[Insertion, ...]]:
    """Return plain stops fitted to a record of `plant`, the best form, and what was seen."""
    true, rng = plant(), np.random.default_rng(0)
    t = DT * np.arange(N)
    tones = [(0.11, 14.0), (0.43, 8.0), (1.3, 6.0), (2.9, 4.0)]
    u = sum(a * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f, a in tones) * np.minimum(t, 1)
    form = exact_form(true)
    assert form is not None
    run = simulate(true, t, {"F": u}, x0=np.zeros(form.n_x), accuracy=1e-6)
    x = np.asarray(run["x"])[:, None]
    floor = 3e-3 * x.std(axis=0)
    x = x + floor * rng.standard_normal(x.shape)
    thirds = [slice(k * N // 9, (k + 1) * N // 9) for k in range(9)]
    train = tuple(s for k, s in enumerate(thirds) if k % 3 != 2)
    data = Data("run", t, {"F": u}, x, ("x",), floor, Split(train, tuple(thirds[2::3]), "thirds"))
    nominal = fit(Problem(plain(), data), max_iterations=10)
    base, options = base_of(nominal), DiagnosisOptions(jobs=1, holds=("linear",))
    hysteresis = by_name("hysteresis")
    classes: Any = None
    task = SearchTask(Looks((hysteresis,), plain()), options, Thresholds(), classes, silent)
    seen, ranked = task.done.of(nominal)
    here = [s for s in ranked if s.element.name == "k"]
    lead = scored(finished(fitted(seen, base.template, here, options), options))[0]
    forms = hysteresis.forms(seen, seen.graph["k"], {"hysteresis": lead.trial.fit.values})
    made = [(f, True) for f in forms]
    tried = finished(fitted_insertions(seen, base.template, made, options), options)
    return lead, best_form(scored(tried), lead, task.limits), seen, forms


def silent(text: str, part: float) -> None:
    pass


@pytest.mark.parametrize(
    ("true", "law"),
    [
        pytest.param(creeping, "hysteresis_with_creep", marks=pytest.mark.long),
        pytest.param(saturating, "stops_in_a_potential", marks=pytest.mark.long),
        (widening, "rate_dependent_prandtl_ishlinskii"),
    ],
)
def test_the_form_that_is_there_is_found(true: Callable[[], BondGraph], law: str) -> None:
    lead, form, _, _ = found(true)
    assert form is not None
    assert (form.trial.effect, form.trial.insertion.law) == ("hysteresis", law)
    assert form.trial.train < 0.5 * lead.trial.train
    assert form.left.most < 0.7 * lead.left.most
    # the form is one of the same name: it stands for the law beside what was found there
    assert set(form.trial.insertion.strengths) > set(lead.trial.insertion.strengths)


@pytest.mark.long
def test_plain_stops_keep_their_name() -> None:
    """Thresholds are not quite the true ones: more of them do better, no other form does surely.

    And a form without its strengths is the plain law.
    """
    lead, form, seen, forms = found(stopping)
    assert lead.left.most > 1.5
    assert form is not None
    assert form.left.most < 1.5
    assert (form.trial.effect, form.trial.insertion.law) == ("hysteresis", "prandtl_ishlinskii")
    t = np.asarray(seen.data.time)

    def response(graph: BondGraph, known: dict[str, float]) -> Any:
        n_x = exact_form(graph).n_x  # type: ignore[union-attr]
        run = simulate(graph, t, seen.data.commands, known, x0=np.zeros(n_x), accuracy=1e-6)
        return np.asarray(run["x"])

    plain_one = response(lead.trial.insertion.graph, dict(lead.trial.fit.values))
    richer = [f for f in forms if f.law not in ("bouc_wen", "prandtl_ishlinskii")]
    assert len(richer) == 3
    for made in richer:
        assert made.graph.check() == ()
        own = [n for n in made.strengths if n not in lead.trial.insertion.strengths]
        values = {**made.starts[0], **dict.fromkeys(own, 1e-9)}
        np.testing.assert_allclose(
            response(made.graph, values), plain_one, atol=1e-4 * np.ptp(plain_one)
        )


def test_of_signals_a_drive_alone_has_a_form() -> None:
    _, _, seen, _ = found(stopping)
    (form,) = by_name("hysteresis").forms(seen, seen.graph["F"], {})
    assert form.law == "bouc_wen"
    (sensor, *_) = seen.graph.of_type(Sensor)
    assert by_name("hysteresis").forms(seen, sensor, {}) == ()


def test_loops_of_a_drive_are_those_of_bouc_and_wen() -> None:
    """Stops cannot follow them, and bristles of the damper were told in their place."""
    lagging = Drive(law=BoucWenMemory(0.35, 2.5, -1.2, 0.1, reach=10.0, sign=-1.0))
    t = np.asarray(DT * np.arange(N), np.float64)
    u = 5.0 + 5.0 * np.sin(0.9 * t) * np.cos(0.13 * t)
    u = u * np.minimum(t, 1.0)
    x = simulate(plain().with_element("F", drive=lagging), t, {"F": u}, x0=np.zeros(2))["x"]
    level = 1e-4 * float(x.std())
    y = (x + level * np.random.default_rng(3).standard_normal(N))[:, None]
    split = Split(slice(0, N), slice(N, N), "all")
    data = Data("loops", t, {"F": u}, y, ("x",), np.array([level]), split)
    seen = scene(fit(Problem(plain(), data), max_iterations=10))
    (form,) = by_name("hysteresis").forms(seen, seen.graph["F"], {})
    made = [
        fit(Problem(form.graph, data, starts=start), max_iterations=40) for start in form.starts
    ]
    best = min(made, key=lambda f: f.cost)
    assert best.cost < 1.5
    rates = np.array([best.values["beta_F"], best.values["gamma_F"]]) / best.values["reach_1_F"]
    np.testing.assert_allclose(rates, [0.25, -0.12], rtol=0.05)
    assert best.values["h_F"] == pytest.approx(0.35, rel=0.05)


def test_stops_of_a_drive_may_have_been_loaded_before_the_record() -> None:
    """The usual ones begin where the record does: no weights follow a memory that was there."""
    stops = StopSum((0.4, 1.1, 2.3, 4.1), height=0.06, sign=-1.0, begun="risen")
    t = np.asarray(DT * np.arange(N // 2), np.float64)
    u = 5.0 + 5.0 * np.sin(0.9 * t) * np.cos(0.13 * t)
    x = simulate(plain().with_element("F", drive=Drive(law=stops)), t, {"F": u})["x"]
    level = 3e-3 * float(x.std())
    y = (x + level * np.random.default_rng(3).standard_normal(t.size))[:, None]
    split = Split(slice(0, t.size), slice(t.size, t.size), "all")
    data = Data("loaded", t, {"F": u}, y, ("x",), np.array([level]), split)
    seen = scene(fit(Problem(plain(), data), max_iterations=10))
    known = {n: 0.05 for n in by_name("hysteresis").insert(seen, seen.graph["F"]).strengths}
    costs: dict[str, float] = {}
    for form in by_name("hysteresis").forms(seen, seen.graph["F"], {"hysteresis": known}):
        if form.law == "prandtl_ishlinskii":
            made = fit(Problem(form.graph, data, starts=form.starts[0]), max_iterations=20)
            law: Any = law_of(form.graph["F"])
            costs[law.inner.begun] = made.cost
    assert list(costs) == ["relaxed", "virgin", "fallen"]  # from zero it is risen as well
    assert costs["virgin"] < 1.5
    assert min(costs["relaxed"], costs["fallen"]) > 4.0


@pytest.mark.long
def test_loops_that_harden_are_named_though_stops_explain_next_to_nothing() -> None:
    """Of Bouc and Wen with beta + gamma < 0; a damper takes the place of what stops could explain.

    Forms without a law say that a memory is possible at the spring, and its richer laws are tried.
    """
    true = spring(m=0.2).with_element("k", law=BoucWenMemory(200.0, 2.0, -2.8, 200.0, reach=0.08))
    true = true.with_values({"k": 150.0})
    rng = np.random.default_rng(0)
    t: Any = DT * np.arange(450)
    u = sum(8.0 * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in np.linspace(0.3, 9.0, 25))
    u = u * np.minimum(t, 1.0)
    x = np.asarray(simulate(true, t, {"F": u}, x0=np.zeros(2), accuracy=1e-6)["x"])
    level = 3e-3 * float(x.std())
    x = x + level * rng.standard_normal(x.size)
    record = Recording("loops", t, {"F": u, "x": x}, units={"F": "N", "x": "m"})
    kept = ("hysteresis", "creep", "nonlinear_stiffness", "presliding_friction", "low_pass")
    others = tuple(e.name for e in CATALOGUE if e.name not in kept)
    options = DiagnosisOptions(jobs=1, keep=4, more=2, effects=1, without=others)
    told = diagnose(spring(m=0.2), record, options=options, hold="linear", noise={"x": level})
    (found,) = told.findings
    assert found.chosen is not None
    assert (found.answer, found.chosen.label) == ("exact", "hysteresis at k")
    assert found.chosen.insertion.law == "bouc_wen"
    values = found.chosen.fit.values
    rates = np.array([values["beta_k"], values["gamma_k"]]) / values["reach_1_k"]
    np.testing.assert_allclose(rates, [25.0, -35.0], rtol=0.1)
    np.testing.assert_allclose([values["k"], values["h_k"]], [150.0, 200.0], rtol=0.1)


def test_a_form_has_to_be_of_the_kind_that_is_told() -> None:
    nothing, at = np.zeros(3), np.zeros(3, int)
    plainly = BlockScore(LeftOut(Rows(at, at, at), nothing, nothing, nothing))

    def told(kind: str, answer: str = "kind") -> Decision:
        kinds = (KindScore("k", kind, plainly, nothing),)
        return Decision(
            "unknown_physics", None, (), (), 0.0, 0.0, (), answer=answer, physics=kind, kinds=kinds
        )

    form = Insertion("hysteresis", "memory", "bouc_wen", "k", plain(), (), ("h",), kind="memory")
    assert not of_told_kind(form, told("surface"))
    assert not of_told_kind(form, told("slow"))
    assert of_told_kind(form, told("memory"))
    assert of_told_kind(form, told("dissipative"))  # a memory holds a curve
    assert of_told_kind(form, told("surface", answer="unknown"))
