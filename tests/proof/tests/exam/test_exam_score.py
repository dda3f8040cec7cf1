"""Answers written by hand beside truths written by hand; then three recordings for good."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from hardware.simulators.judging.claims import exam_answer_of
from hardware.simulators.judging.truths import truth_of
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.proof.exam import answering
from tests.proof.exam.__main__ import main
from tests.proof.exam.answering import transplant
from tests.proof.exam.counting import score_exam, stated
from tests.proof.exam.printing import bad_lines, table_lines
from tests.proof.tests.exam.made_up import (
    BACKLASH,
    MISSING,
    PORTS,
    UNKNOWN,
    counted,
    effect,
    finding,
    judged,
    said,
    truth,
)
from tests.proof.trial.rates import Rate


@pytest.mark.parametrize(
    ("row", "content", "outcome", "wrong"),
    [
        (truth("control"), said("explained"), "quiet", ()),
        (truth("control"), said(MISSING, finding("exact", "backlash")), "alarm", ("false alarm",)),
        (truth("control"), said("insufficient_data"), "insufficient", ()),
        (
            truth("control"),
            said("parameters_only", over=3.1),
            "quiet",
            ("misfit called explained",),
        ),
        (BACKLASH, said(MISSING, finding("exact", "backlash")), "right", ()),
        (BACKLASH, said(MISSING, finding("approximate", "backlash")), "right", ()),
        (BACKLASH, said(MISSING, finding("exact", "backlash", "b_2", same=["k_2"])), "right", ()),
        (
            BACKLASH,
            said(MISSING, finding("exact", "backlash", "k_1")),
            "wrong place",
            ("wrong place",),
        ),
        (
            BACKLASH,
            said(MISSING, finding("exact", "coulomb_friction")),
            "wrong name",
            ("wrong name",),
        ),
        (BACKLASH, said(MISSING, finding("family", "unknown", family="restoring")), "family", ()),
        (
            BACKLASH,
            said(MISSING, finding("family", "unknown", family="friction")),
            "wrong name",
            ("wrong name",),
        ),
        (
            BACKLASH,
            said(MISSING, finding("look_alikes", also_possible=[
                {"effect": "backlash", "element": "k_2"},
                {"effect": "coulomb_friction", "element": "b_2"},
            ])),
            "set",
            (),
        ),
        (
            BACKLASH,
            said(MISSING, finding("look_alikes", also_possible=[
                {"effect": "creep", "element": "k_2"},
                {"effect": "coulomb_friction", "element": "b_2"},
            ])),
            "wrong name",
            ("wrong name",),
        ),
        (BACKLASH, said(UNKNOWN, finding("kind", kind="restoring")), "kind", ()),
        (BACKLASH, said(UNKNOWN, finding("kind", kind="memory")), "kind", ("wrong kind",)),
        (BACKLASH, said(UNKNOWN, finding("unknown")), "placed", ()),
        (BACKLASH, said(UNKNOWN, finding("unknown", place="")), "unknown", ()),
        (
            # more than half of the ports is no place
            BACKLASH,
            said(UNKNOWN, finding("unknown", place="k_1", same=PORTS[:5])),
            "unknown",
            (),
        ),
        (BACKLASH, said("explained", over=0.4), "missed", ("effect called explained",)),
        (BACKLASH, said("explained", over=0.2), "missed", ()),
        (truth("single", effect(moved=2.9)), said("explained", over=0.4), "missed", ()),
        (
            truth("outside", effect("unknown")),
            said(MISSING, finding("exact", "backlash")),
            "wrong name",
            ("wrong name", "outside named"),
        ),
        (
            truth("outside", effect("unknown")),
            said(MISSING, finding("family", "unknown", family="restoring")),
            "family",
            (),
        ),
    ],
)  # fmt: skip
def test_an_answer_beside_its_truth(
    row: Mapping[str, Any], content: Mapping[str, Any], outcome: str, wrong: tuple[str, ...]
) -> None:
    found = judged(row, content)
    assert found.outcome == outcome
    assert found.wrong == wrong


def test_a_crash_is_counted() -> None:
    found = judged(BACKLASH, {"id": "e0", "verdict": None, "error": "Boom", "seconds": 1.0})
    assert found.outcome == "crash"
    assert found.wrong == ("crash",)
    assert "Boom" in bad_lines([found])[0]


def test_of_several_effects_each_claim_speaks_of_its_own() -> None:
    row = truth("two", effect(), effect("coulomb_friction", "b_1", 5.0))
    both = said(MISSING, finding("exact", "backlash"), finding("exact", "coulomb_friction", "b_1"))
    mixed = said(MISSING, finding("exact", "backlash", "b_1"))
    assert judged(row, both).found == set(truth_of(row).effects)
    assert judged(row, mixed).wrong == ("wrong place",)
    score = counted((row, both), (row, mixed), (row, said(MISSING, finding("exact", "backlash"))))
    assert score.rates["several effects that all show: all found"] == Rate(1, 3)
    assert score.rates["several effects that all show: strongest found"] == Rate(2, 3)


def test_a_name_for_exchanged_channels_is_a_wrong_one() -> None:
    row = truth("mixed_up", effect("unknown", "x_1"))
    exact = said(MISSING, finding("exact", "sensor_gain", "x_1"))
    rates = counted((row, exact), (row, said(UNKNOWN, finding("unknown")))).rates
    assert rates["wrong names, of the names given"] == Rate(1, 1)
    assert rates["wrong exact names, of those given"] == Rate(1, 1)
    assert rates["outside the catalogue named exactly"] == Rate(0, 0)


def test_a_stated_probability_is_of_name_and_place() -> None:
    """As where it is read from: `certify` counts a right name at a wrong place as wrong."""
    sure = {"probability": 0.9}
    found = [
        judged(BACKLASH, said(MISSING, finding("exact", "backlash", place, **sure)))
        for place in ("k_2", "k_1", "")
    ]
    assert stated(found) == [(0.9, True), (0.9, False), (0.9, True)]


def test_rates_have_the_right_denominators() -> None:
    right = said(MISSING, finding("exact", "backlash", probability=0.97))
    score = counted(
        (truth("control"), said("explained")),
        (truth("control"), said(UNKNOWN, finding("unknown"))),
        (truth("control"), said("insufficient_data")),
        (BACKLASH, right),
        (BACKLASH, said("explained", over=5.0)),
        (BACKLASH, said(UNKNOWN, finding("kind", kind="restoring"))),
        (truth("single", effect(moved=1.0)), said("explained", over=0.1)),
        (truth("outside", effect("unknown")), said(MISSING, finding("exact", "creep", "k_2"))),
    )
    expected = {
        "false alarms, of the controls": Rate(1, 3),
        "insufficient data, of the controls": Rate(1, 3),
        "misfit above 3 times the noise, of those called explained": Rate(1, 3),
        "called explained, of those where an effect shows": Rate(1, 4),
        "wrong names, of the names given": Rate(0, 1),
        "wrong places, of the places given": Rate(0, 3),
        "wrong kinds, of the kinds given": Rate(0, 1),
        "outside the catalogue named exactly": Rate(1, 1),
        "sharp: right name at the right place": Rate(1, 3),
        "sharp: right place, and right name or kind": Rate(2, 3),
        "truth in the set of names, of those told": Rate(1, 2),
        "truth in the set of places, of those told": Rate(2, 2),
        "truth not excluded, names": Rate(2, 2),
        "truth not excluded, places": Rate(2, 2),
    }
    assert {k: score.rates[k] for k in expected} == expected
    assert score.cells["single"] == {"right": 1, "missed": 2, "kind": 1}
    (line,) = score.reliability
    assert (line.low, line.stated, line.right) == (0.95, 0.97, Rate(1, 1))
    assert score.seconds["seconds, median"] == 2.0


@pytest.mark.parametrize(
    ("found", "name", "place"),
    [
        (finding("unknown", place=""), True, True),
        (finding("unknown", place="k_1"), True, False),
        (finding("kind", kind="restoring"), True, True),
        (finding("kind", kind="slow"), False, True),
        (finding("exact", "creep"), False, True),
        (finding("exact", "backlash", "k_1"), True, False),
        (finding("exact", "backlash", "k_1", same=["k_2"]), True, True),
        (finding("look_alikes", "creep", also_possible=[{"effect": "backlash", "element": "k_2"}]),
         True, True),
    ],
)  # fmt: skip
def test_what_an_answer_excludes(found: dict[str, Any], name: bool, place: bool) -> None:
    verdict = MISSING if found["answer"] == "exact" else UNKNOWN
    score = counted((BACKLASH, said(verdict, found)))
    assert score.rates["truth not excluded, names"] == Rate(int(name), 1)
    assert score.rates["truth not excluded, places"] == Rate(int(place), 1)


def test_two_sets_of_answers_stand_side_by_side() -> None:
    old = counted((BACKLASH, said("explained", over=5.0)))
    new = counted((BACKLASH, said(MISSING, finding("exact", "backlash"))))
    lines = table_lines(new, old)
    (line,) = [n for n in lines if n.startswith("sharp: right name")]
    assert line.index("0/1") < line.index("1/1")
    assert str(Rate(0, 149)) == "0/149  0.0 % (0.0-2.4)"


def test_halves_that_contradict_the_whole() -> None:
    rows = {i: truth_of({**BACKLASH, "id": i}) for i in ("e0", "e1")}
    whole = {
        i: exam_answer_of({**said(MISSING, finding("exact", "backlash")), "id": i}) for i in rows
    }
    half = {
        "e0": exam_answer_of({**said(MISSING, finding("exact", "creep")), "id": "e0"}),
        "e1": exam_answer_of({**said("explained"), "id": "e1"}),
    }
    rates = score_exam(rows, whole, {"half a record": half}).rates
    assert rates["half a record: alarm on one side only"] == Rate(1, 2)
    assert rates["half a record: names that exclude each other"] == Rate(1, 1)
    assert rates["half a record: places that exclude each other"] == Rate(0, 1)
    assert rates["half a record: the same verdict, names and places"] == Rate(0, 2)


def test_a_transplant_is_the_model_with_its_residuals_drawn_anew() -> None:
    n = 400
    time, command = np.linspace(0.0, 3.99, n), np.sin(np.arange(n))
    model = np.cos(0.05 * np.arange(n))
    left = 0.1 * np.random.default_rng(1).standard_normal(n)
    channels = {"F": command, "x": model + left}
    data = SimpleNamespace(
        readings=channels["x"][:, None], names=("x",), time=time, commands={"F": command}
    )
    fit = SimpleNamespace(problem=SimpleNamespace(data=data), simulated=model[:, None])
    recording = Recording("r", time, channels, {"F": "N", "x": "m"})
    found = SimpleNamespace(repaired=None, nominal=fit, recording=recording)
    made = transplant(cast(Diagnosis, found), 0)
    residual = made["x"] - model
    assert np.array_equal(made["F"], command)
    assert np.std(residual) == pytest.approx(np.std(left), rel=0.2)
    assert abs(np.corrcoef(residual, left)[0, 1]) < 0.3
    assert {float(f"{r:.9f}") for r in residual} <= {float(f"{r:.9f}") for r in left}
    assert transplant(cast(Diagnosis, found), 0)["x"] == pytest.approx(made["x"])


def test_the_three_steps(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # what is answered does not matter here
    narrow = partial(DiagnosisOptions, keep=1, more=0, effects=1)
    monkeypatch.setattr(answering, "DiagnosisOptions", narrow)
    folder = ["--folder", str(tmp_path / "exam")]
    assert main(["generate", *folder, "--count", "2", "--seed", "5", "--jobs", "1"]) == 0
    assert main(["run", *folder, "--limit", "1", "--jobs", "1"]) == 0
    (path,) = (tmp_path / "exam" / "answers").glob("*.json")
    content = json.loads(path.read_text())
    assert content["error"] is None
    assert content["cpu_seconds"] > 0
    assert content["baselines"]["screening"]
    assert set(content["nominal_rms"]) <= set(content["verdict"]["recording"]["channels"])
    assert main(["run", *folder, "--limit", "1", "--jobs", "1", "--of", "half"]) == 0
    capsys.readouterr()
    assert main(["run", *folder, "--limit", "1", "--jobs", "1"]) == 0
    assert "0 recordings diagnosed, 1 were there" in capsys.readouterr().out
    half = ["--half", str(tmp_path / "exam" / "answers-half")]
    assert main(["score", *folder, "--beside", str(path.parent), "--list", *half]) == 0
    assert "false alarms, of the controls" in capsys.readouterr().out
    assert main(["score", "--folder", str(tmp_path / "none")]) == 2
    assert "generate first" in capsys.readouterr().err
