"""Process noise in a diagnosis: what it leaves is no physics, and physics shows beside it."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Recording
from bondsight.cli.main import main
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.evidence.predicted import Predicted, predicted
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import in_words, verdict
from identification.study.study import Study
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE, PUSH = 1500, 0.005, 2e-6, 0.03
OPTIONS = DiagnosisOptions(jobs=1, keep=3, more=1, effects=1)
KEPT = ("nonlinear_stiffness", "end_stop", "hysteresis", "quadratic_drag")
OTHERS = tuple(e.name for e in CATALOGUE if e.name not in KEPT)
"""What is not held against a spring that hardens; a random force is held against all."""


def record(cubic: float = 0.0, seed: int = 1, n: int = N) -> Recording:
    """A mass that a random force pushes as well, which nobody records."""
    t = np.asarray(DT * np.arange(n), np.float64)
    rng = np.random.default_rng(seed)
    waves = np.sin(2 * np.pi * np.outer(t, (0.7, 1.9, 4.1)) + rng.uniform(0, 2 * np.pi, 3))
    force = waves @ np.array([2.0, 1.0, 0.5])
    truth: BondGraph = spring().with_element("k", law=Polynomial(orders=(3,), size=1.0))
    pushed = {"F": force + PUSH * rng.standard_normal(n)}
    x = np.asarray(simulate(truth, t, pushed, {"a_3_k": cubic})["x"])
    read = x + NOISE * rng.standard_normal(n)
    return Recording("run", t, {"F": force, "x": read}, {"F": "N", "x": "m"})


@lru_cache
def found(cubic: float = 0.0, *, told: bool = True) -> Diagnosis:
    places = ("m",) if told else None
    asked = Study(
        spring(m=0.7), record(cubic), hold="linear", noise={"x": NOISE}, process_noise=places
    )
    return diagnose(asked, options=replace(OPTIONS, without=OTHERS if cubic else ()))


@pytest.mark.long
def test_random_forces_are_no_physics_where_the_study_knows_of_them() -> None:
    assert found(told=False).kind == "unknown_physics"  # free runs wander off
    d = found()
    assert d.kind == "parameters_only"  # the mass was declared wrong
    assert "process noise at m" in d.steps[-1].reasons[0]
    assert d.left is not None
    assert d.left.most == pytest.approx(1.0, abs=0.2)
    said = verdict(d)
    assert said["findings"] == []
    assert any("one-step predictions" in n for n in said["notes"])
    assert "process noise" in in_words(d)
    assert d.study.process_noise == ("m",)


def test_an_effect_shows_beside_random_forces() -> None:
    d = found(4e4)
    assert d.kind == "missing_physics"
    step = d.findings[0]
    assert step.chosen is not None
    assert step.chosen.label == "nonlinear_stiffness at k"
    assert step.answer == "approximate"
    assert "one-step predictions of held-out samples are better" in step.reasons[0]
    assert d.left is not None
    assert d.left.most < 1.3


def test_the_intensity_that_was_added_is_found() -> None:
    study = Study(spring(), record(), hold="linear", noise={"x": NOISE}, process_noise=("m",))
    p = predicted(study)
    # white force, held over a sample, is a walk of the momentum
    level = float(p.levels.split("(")[1].split()[0])
    assert level == pytest.approx(PUSH * np.sqrt(DT), rel=0.1)
    assert p.is_noise
    wrong = predicted(study.changed(graph=spring(k=400.0), free=("m", "d")))
    assert wrong.behind(p) > 3
    assert not wrong.is_noise


def test_stretches_agree_on_what_predicts_better() -> None:
    rng = np.random.default_rng(0)
    better = Predicted(rng.normal(size=40), 0.0, {}, "")
    worse = replace(better, losses=better.losses + rng.normal(1.0, 0.5, 40))
    assert worse.behind(better) > 5
    assert better.behind(worse) == pytest.approx(-worse.behind(better))
    assert better.behind(better) == 0.0
    once = better.losses.copy()
    once[3] += 100.0  # one stretch is no proof
    assert replace(better, losses=once).behind(better) < 1.5


@pytest.mark.long
def test_the_command_takes_places_and_names_wrong_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    r = record(4e4, n=1200)
    run = tmp_path / "run.csv"
    table = np.column_stack([r.time, r["F"], r["x"]])
    np.savetxt(run, table, delimiter=",", header="time[s],F[N],x[m]", comments="")
    model, out = "tests.spring:spring", tmp_path / "out"
    words = ["diagnose", str(run), "--model", model, "--out", str(out), "--jobs", "1"]
    assert main([*words, "--process-noise", "q"]) == 2
    assert "no place for process noise 'q'" in capsys.readouterr().err
    few = ["--effects", "1", "--hold", "linear", "--noise", f"x={NOISE}"]
    few += [word for name in OTHERS for word in ("--without", name)]
    assert main([*words, *few, "--process-noise", "m"]) == 0
    said = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
    assert [f["effect"] for f in said["findings"]] == ["nonlinear_stiffness"]
    assert any("process noise at m" in n for n in said["notes"])
