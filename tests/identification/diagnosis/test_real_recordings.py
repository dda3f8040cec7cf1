"""Measured recordings whose physics is known from the literature; the tool is not told."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from actuators.models.catalogue import MODELS
from identification import datasets as data
from identification.datasets.opening import match_by_unit
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import normalised_error, verdict
from tests.proof.real.running import run_cases

pytestmark = [pytest.mark.recordings, pytest.mark.slow]

Found = tuple[Diagnosis, dict[str, Any]]
ALONE = DiagnosisOptions(jobs=1)


def judged(recording: str, model: str, options: DiagnosisOptions = ALONE) -> Found:
    if not data.available(recording):
        pytest.skip(f"{recording}: set {data.FOLDER_VARIABLE} to the folder of the recordings")
    measured, split = data.load(recording)
    graph = MODELS[model]()
    measured, _ = match_by_unit(measured, graph)
    d = diagnose(graph, measured, split, model=model, options=options)
    return d, verdict(d)


@pytest.fixture(scope="module")
def piezo() -> Found:
    return judged("piezo-actuator-sine", "stack_bond_graph")


@pytest.fixture(scope="module")
def emps() -> Found:
    return judged("emps", "mass_with_viscous_friction")


@pytest.fixture(scope="module")
def silverbox() -> Found:
    return judged("silverbox", "resonator")


@pytest.fixture(scope="module")
def hair_dryer() -> Found:
    return judged("hair_dryer", "thermal_lag", replace(ALONE, keep=3, more=1))


@pytest.mark.long
def test_piezo_has_hysteresis_in_its_polarisation(piezo: Found) -> None:
    d, v = piezo
    assert v["verdict"] == "missing_physics"
    (finding,) = v["findings"]
    assert finding["effect"] == "hysteresis"
    place = finding["location"]
    assert "C_nl" in {place["element"], *place["indistinguishable_from"]}
    assert place["indistinguishable_from"]
    assert v["advice"]
    assert d.nominal is not None
    assert d.repaired is not None
    assert normalised_error(d.nominal)["x"] > 0.12
    assert normalised_error(d.repaired)["x"] < 0.015


@pytest.mark.long
def test_emps_has_friction_in_its_guide(emps: Found) -> None:
    """At 500,000 times the encoder's floor no law is exact; its family is friction."""
    _, v = emps
    assert v["verdict"] in ("missing_physics", "unknown_physics")
    first = v["findings"][0]
    assert first["family"] == "friction"
    assert first["location"]["element"] == "F_v"
    assert "offset_F" in {n["name"] for n in v["nuisances"]}


@pytest.mark.long
def test_silverbox_has_a_cubic_spring(silverbox: Found) -> None:
    _, v = silverbox
    assert v["verdict"] == "missing_physics"
    (finding,) = v["findings"]
    assert finding["effect"] == "nonlinear_stiffness"
    assert finding["location"]["element"] == "k"
    assert v["fit"]["repaired"]["test_rmse"]["y"] < 1e-3


@pytest.mark.long
def test_mr_damper_yields_before_it_slides(tmp_path: Path) -> None:
    if not data.set_available("mr_damper"):
        pytest.skip(f"mr-damper: set {data.FOLDER_VARIABLE} to the folder of the recordings")
    (outcome,) = run_cases(tmp_path, ("mr_damper",), jobs=1)
    assert outcome.outcome == "right", outcome
    found = json.loads((tmp_path / "mr_damper" / "verdict.json").read_text(encoding="utf-8"))
    assert [f["effect"] for f in found["findings"]] == ["presliding_friction"]
    assert found["findings"][0]["location"]["element"] == "c"


@pytest.mark.long
def test_hair_dryer_has_nothing_but_dead_time(hair_dryer: Found) -> None:
    _, v = hair_dryer
    for finding in v["findings"]:
        if finding["effect"] == "unknown":
            assert finding["also_possible"][0]["effect"] == "delay"
        else:
            assert finding["effect"] == "delay"
