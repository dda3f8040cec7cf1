"""What is drawn, called right and counted where a model lacks an element."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from actuators.models.plants import plant_model
from bondgraph.graph.elements import C, I, R
from hardware.simulators.generator.making_exam import exam_record
from identification import DiagnosisOptions, diagnose
from tests.proof.exam.world import EXAM
from tests.proof.lacking.__main__ import main
from tests.proof.lacking.answering import write_elements
from tests.proof.lacking.drawing import Lacking, drawn, model_of, removable, truth_of
from tests.proof.lacking.scoring import judged, score_lines
from tests.proof.trial.generating import make_all
from tests.proof.trial.layout import Layout
from tests.proof.trial.running import recording_of
from tests.proof.trial.truths import read_public


def test_the_same_seed_draws_the_same_and_every_plant_has_its_turn() -> None:
    cases = drawn(3, 18)
    assert cases[:9] == drawn(3, 9) != drawn(4, 9)
    assert {c.case.plant for c in cases[:9]} == set(EXAM.plants)
    for c in cases:
        assert not c.case.effects
        assert isinstance(model_of(c)[c.element], R | C | I)
        assert removable(model_of(c), c.element)


def test_an_element_with_a_law_is_no_linear_one() -> None:
    press = plant_model("press")
    assert not removable(press, "k_1")
    assert removable(press, "b_1")


def chain(element: str) -> Lacking:
    case = next(c.case for c in drawn(0, 9) if c.case.plant == "chain")
    return Lacking(case, element)


@pytest.mark.parametrize(
    ("element", "name", "beside"),
    [("b_2", "linear_loss", "k_2"), ("k_2", "linear_spring", "b_2")],
)
def test_a_lacking_element_is_right_anywhere_on_its_flow(
    element: str, name: str, beside: str
) -> None:
    (effect,) = truth_of(chain(element)).effects
    assert effect.names == {name}
    assert beside in effect.places
    assert not effect.places & {"k_1", "k_3", "m_2"}


@pytest.mark.parametrize(
    ("plant", "element", "beside"),
    [
        ("oven", "C_1", "P"),
        ("tanks", "C_2", "p_2"),
        ("probe", "C_f", "v_f"),
        ("stack", "C_a", "R_a"),
    ],
)
def test_a_lacking_capacity_is_right_at_the_effort_that_it_holds(
    plant: str, element: str, beside: str
) -> None:
    case = next(c.case for c in drawn(0, 9) if c.case.plant == plant)
    (effect,) = truth_of(Lacking(case, element)).effects
    assert effect.names == {"linear_capacity"}
    assert beside in effect.places


def test_a_mass_between_two_springs_has_no_name() -> None:
    assert truth_of(chain("m_2")).outside


NOISE = {"x_1": 1e-6, "x_2": 1e-6, "x_3": 1e-6}


def said(effect: str, element: str, value: float, over: float = 5.0) -> dict[str, Any]:
    finding = {
        "location": {"element": element, "indistinguishable_from": []}, "answer": "exact",
        "effect": effect, "family": "storage", "kind": "dissipative", "also_possible": [],
        "parameters": [{"value": value, "ci95": [value - 0.1, value + 0.1]}],
    }  # fmt: skip
    return {
        "id": "l0000",
        "verdict": {"verdict": "missing_physics", "findings": [finding]},
        "ports": sorted(model_of(chain("b_2")).elements),
        "nominal_rms": dict.fromkeys(NOISE, over * 1e-6),
        "repaired_rms": dict.fromkeys(NOISE, 1.02e-6),
        "seconds": 3.0,
    }


def row(value: float) -> Mapping[str, Any]:
    return {"noise_std": NOISE, "parameters": {"b_2": value}}


def test_name_place_and_coefficient_are_held_against_the_plant() -> None:
    right = judged(chain("b_2"), row(8.05), said("linear_loss", "k_2", 8.0))
    assert right.outcome.outcome == "right"
    assert right.held is True
    assert math.isclose(right.left, 1.02)
    off = judged(chain("b_2"), row(8.2), said("linear_loss", "k_2", 8.0))
    assert off.held is False
    assert "outside its interval" in off.line
    astray = judged(chain("b_2"), row(8.0), said("linear_loss", "k_1", 8.0))
    assert astray.outcome.outcome == "wrong place"
    assert astray.held is None
    other = judged(chain("b_2"), row(8.0), said("coulomb_friction", "k_2", 8.0))
    assert other.outcome.outcome == "wrong name"


def test_nothing_missing_beside_a_misfit_is_counted() -> None:
    quiet = said("linear_loss", "k_2", 8.0, over=1.5)
    quiet["verdict"] = {"verdict": "parameters_only", "findings": []}
    found = judged(chain("b_2"), row(8.0), quiet)
    assert found.outcome.effect_explained
    (line,) = (w for w in score_lines([found]) if w.startswith("nothing missing was said"))
    assert line.split()[-4] == "1/1"
    at_noise = judged(chain("b_2"), row(8.0), {**quiet, "nominal_rms": NOISE})
    assert not at_noise.outcome.effect_explained


@pytest.mark.long
@pytest.mark.parametrize(
    ("number", "label"),
    [
        (11, "linear_spring at b_s"),  # what is nearest at first is hardly any spring
        (16, "linear_loss at k_c"),  # relations say another place, each where its descent ended
        (38, "linear_spring at b_s"),
    ],
)
def test_what_was_told_wrongly_once(tmp_path: Path, number: int, label: str) -> None:
    layout = Layout(tmp_path / "f")
    lacking = drawn(0, number + 1)[number]
    make_all([lacking.case], layout, exam_record, 1, None)
    (public,) = read_public(layout.public)
    graph = model_of(lacking).remove(lacking.element)
    options = DiagnosisOptions(jobs=1, effects=1)
    found = diagnose(graph, recording_of(layout, public), options=options, hold=public.hold)
    (step,) = found.findings
    assert step.chosen is not None
    assert step.chosen.label == label


def test_the_score_of_a_folder_without_answers_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["score", "--folder", str(tmp_path)]) == 2
    assert "nothing was asked here" in capsys.readouterr().err


def test_elements_are_read_as_they_were_written(tmp_path: Path) -> None:
    from tests.proof.lacking.answering import elements_of

    write_elements(tmp_path, {"l0000": "k_1"})
    assert elements_of(Layout(tmp_path)) == {"l0000": "k_1"}
