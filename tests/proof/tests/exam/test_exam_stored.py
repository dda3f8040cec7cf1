"""Evidence kept as numbers decides as the evidence itself."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Recording
from hardware.simulators.judging.claims import exam_answer_of
from hardware.simulators.judging.truths import ConcealedEffect, ExamTruth
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.evidence.answer import RIGHT
from identification.diagnosis.evidence.decision import decide
from identification.diagnosis.evidence.hypotheses import Evidence, Thresholds
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.search import one_step
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import verdict
from tests.identification.diagnosis.decision_cases import ROWS, Case, N, lag
from tests.proof.exam import certifying, stored
from tests.proof.exam.certifying import GATES, GRID, UNTOLD, certify_lines, replayed, settings
from tests.proof.exam.stored import evidence_of, recorded
from tests.settled import simulate
from tests.spring import spring


@pytest.mark.parametrize("friction", [0.0, pytest.param(0.3, marks=pytest.mark.long)])
def test_stored_evidence_gives_the_same_decisions(friction: float) -> None:
    t = np.asarray(0.01 * np.arange(1200), np.float64)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 3 * np.sin(2 * np.pi * 2.3 * t)
    truth = spring().with_element("d", law=Coulomb(friction)) if friction else spring()
    x = simulate(truth, t, {"F": u})["x"] + 1e-5 * np.random.default_rng(1).standard_normal(t.size)
    recording = Recording("run", t, {"F": u, "x": x}, {"F": "N", "x": "m"})
    with recorded() as kept:
        found = diagnose(spring(), recording, options=DiagnosisOptions(jobs=1, effects=1))
    assert len(kept) == len(found.steps)
    again = [decide(evidence_of(c)) for c in json.loads(json.dumps(kept))]
    assert [d.kind for d in again] == [d.kind for d in found.steps]
    assert [d.answer for d in again] == [d.answer for d in found.steps]
    assert [d.places for d in again] == [d.places for d in found.steps]
    assert [d.chosen and d.chosen.label for d in again] == [
        d.chosen and d.chosen.label for d in found.steps
    ]
    content = {
        "id": "e0", "verdict": verdict(found), "evidence": kept, "ports": ["F", "m", "d", "k", "x"],
        "seconds": 1.0, "cpu_seconds": 1.0,
    }  # fmt: skip
    assert replayed(content, Thresholds()) == exam_answer_of(content)
    blunt = replayed(content, Thresholds(gain=1e9))
    assert blunt.verdict != "missing_physics"
    assert not any(c.named for c in blunt.claims)
    if friction:
        assert found.kind == "missing_physics"
        strict = replayed(content, Thresholds(z=1e6))
        assert strict.claims == (UNTOLD,)
        assert strict.alarm


def restored(e: Evidence) -> Evidence:
    return evidence_of(json.loads(json.dumps(stored.stored(e))))


def test_a_law_that_is_idle_stays_so() -> None:
    case = Case(9.0).law("coulomb_friction at d", 0.0).law("quadratic_drag at d", lag(1.0))
    case.laws[1] = replace(case.laws[1], idle=True)
    d = decide(restored(case.evidence()))
    assert (d.answer, d.places) == (case.decided().answer, case.decided().places)
    assert d.answer != decide(replace(case.evidence(), laws=tuple(
        replace(s, idle=False) for s in case.evidence().laws
    ))).answer  # fmt: skip
    older = stored.stored(case.evidence())
    del older["several"], older["recordings"]
    for row in older["laws"]:
        del row["idle"]
    assert not any(s.idle for s in evidence_of(older).laws)


def test_whose_noise_is_known_is_kept() -> None:
    known = Remaining({"x": 2.0, "v": 3.0}, False, 1.0, {}, 1.5, frozenset({"v"}))
    evidence = Case(9.0, known).law("hysteresis at k", 2.0).evidence()
    assert restored(evidence).before == known
    older = stored.stored(evidence)
    older["before"] = older["before"][:5]
    assert evidence_of(older).before == replace(known, sure=frozenset())


@pytest.mark.parametrize("agreed", [True, False])
def test_what_several_recordings_agree_on_is_kept(agreed: bool) -> None:
    where = 1.0 if agreed else np.where(ROWS.sample < N // 2, 1.0, 0.0)
    case = Case(9.0, where=where, several=True).law("hysteresis at k", 2.0, test=99.0)
    case.law("coulomb_friction at d", 2.0, test=99.0).kind("memory", "k", 2.0)
    for s in case.laws:
        problem: Any = s.trial.fit.problem
        problem.data = replace(problem.data, breaks=(N // 2,))
    again = decide(restored(case.evidence()))
    assert again.places == case.decided().places
    assert set(again.places) == ({"k", "d"} if agreed else set())


@pytest.mark.parametrize("told", [True, False])
def test_the_first_search_stays_first(told: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a search on finer stretches looked at comes after it, or not at all."""
    whole, steps = import_module(diagnose.__module__), import_module(one_step.__name__)

    def search(floor: float, *names: str) -> None:
        data = SimpleNamespace(names=("x",), floor=[floor])
        whole.steps(SimpleNamespace(fit=SimpleNamespace(problem=SimpleNamespace(data=data))))
        for name in names:
            steps.decide(SimpleNamespace(plain=object(), name=name))

    def finer() -> tuple[str | None, bool]:
        search(2.0, "c")
        return "found" if told else None, False

    monkeypatch.setattr(stored, "steps", lambda base: None)
    monkeypatch.setattr(stored, "decide", lambda evidence, limits: None)
    monkeypatch.setattr(stored, "stored", lambda evidence: {"name": evidence.name})
    monkeypatch.setattr(stored, "on_finer_stretches", finer)
    with recorded() as kept:
        search(9.0, "of another diagnosis")
        search(1.0, "a", "b")
        whole.on_finer_stretches()
    found = [(e["name"], e["floors"]["x"]) for e in kept]
    assert found == [("a", 1.0), ("b", 1.0), *([("c", 2.0)] if told else [])]


def test_a_decision_made_again_with_more_laws_is_kept_once() -> None:
    """One candidate is fitted at first, a wrong one: the evidence asks for others."""
    t = np.asarray(0.01 * np.arange(1200), np.float64)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 3 * np.sin(2 * np.pi * 2.3 * t)
    rubbing = simulate(spring().with_element("d", law=Coulomb(0.5)), t, {"F": u})
    x = rubbing["x"] + 1e-5 * np.random.default_rng(1).standard_normal(t.size)
    recording = Recording("run", t, {"F": u, "x": x}, {"F": "N", "x": "m"})
    kept_away = ("coulomb_friction", "stribeck_friction", "presliding_friction")
    options = DiagnosisOptions(jobs=1, keep=1, more=2, effects=1, without=kept_away)
    with recorded() as kept:
        found = diagnose(spring(), recording, options=options)
    assert found.kind == "unknown_physics"
    assert len(kept) == len(found.steps) == 1
    laws = {(x["effect"], x["element"]) for x in kept[0]["laws"]}
    assert len(laws - {("unknown", "d")}) > 1
    assert laws == {(c.effect, c.element) for c in found.steps[0].trials}


def truth(number: int, *, control: bool) -> ExamTruth:
    concealed = ConcealedEffect(
        "backlash", frozenset({"backlash"}), "restoring", frozenset({"restoring"}),
        frozenset({"k"}), "gap", 9.0,
    )  # fmt: skip
    effects = () if control else (concealed,)
    return ExamTruth(f"e{number}", "single", "chain", effects, {"x": 1.0}, {"x": 9.0})


def outside(number: int) -> ExamTruth:
    concealed = ConcealedEffect(
        "unknown", frozenset(), "outside", frozenset({"surface"}), frozenset({"k"}), "odd", 0.1
    )
    return ExamTruth(f"e{number}", "outside", "chain", (concealed,), {"x": 1.0}, {"x": 0.1})


def said(number: int, name: str) -> dict[str, Any]:
    place = {"element": "k", "indistinguishable_from": []}
    finding = {"answer": "exact", "effect": name, "family": "restoring", "location": place}
    named = {"verdict": "missing_physics", "findings": [finding]}
    return {
        "id": f"e{number}", "ports": list("abcdefg"),
        "verdict": named if name else {"verdict": "explained", "findings": []},
    }  # fmt: skip


@pytest.mark.parametrize(("wrong", "right"), [(0, True), (9, False)])
def test_gates_are_certified_by_many_answers_and_few_errors(wrong: int, right: bool) -> None:
    truths = {f"e{i}": truth(i, control=i < 200) for i in range(400)}
    names = ["" if i < 200 else "creep" if i < 200 + wrong else "backlash" for i in range(400)]
    contents = [said(i, name) for i, name in enumerate(names)]
    assert GRID[-1] == Thresholds()
    gates = settings(truths, contents)
    first = next(gates)
    gate = "wrong names, of the names given"
    assert (first.p(gate) < 0.05) is right
    assert first.p(gate) == pytest.approx(float(binom.cdf(wrong, 200, 0.02)))
    lines = certify_lines(truths, contents)
    # nothing outside the catalogue was asked, so that gate stays open
    assert any(line.endswith("none: too few answers or too many errors") for line in lines)
    asked = {**truths, **{f"e{i}": outside(i) for i in range(400, 500)}}
    more = [*contents, *(said(i, "") for i in range(400, 500))]
    walked = certify_lines(asked, more)[len(GRID) * (1 + len(GATES))]
    assert ("none" not in walked) is right
    counted = next(line for line in lines if line.startswith("exact"))
    assert f"{200 - wrong}/200" in counted
    assert f"{(201 - wrong) / 202:.3f}" in counted


def test_the_stated_probabilities_are_those_of_the_results() -> None:
    """The table that the tool reads them from is committed beside the exam."""
    text = (Path(certifying.__file__).parent / "RESULTS.md").read_text(encoding="utf-8")
    found = dict(re.findall(r"^(\w+) +right .* stated (\d\.\d+)$", text, re.MULTILINE))
    assert set(RIGHT) <= set(found)
    for answer, share in RIGHT.items():
        assert share == pytest.approx(float(found[answer]), abs=0.005)
