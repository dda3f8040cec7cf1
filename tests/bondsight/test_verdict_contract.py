"""What is written keeps the contract that other programs read; too little to go on, too."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.models.opening import load_model
from bondsight.cli.main import main
from tests.bondsight.carriage_files import carriage, table

VERDICTS = {
    "explained", "parameters_only", "missing_physics", "unknown_physics", "insufficient_data",
}  # fmt: skip
KINDS = {
    "storage", "resistor", "inertia", "transformer", "source", "junction", "sensor", "clock",
}  # fmt: skip
PHYSICS = {
    "restoring", "dissipative", "surface", "memory", "slow", "mode", "ratio", "command", "sensing",
    "time", "exogenous",
}  # fmt: skip
EFFECTS = {
    "memory": {"hysteresis", "creep"},
    "friction": {
        "coulomb_friction", "stribeck_friction", "presliding_friction", "quadratic_drag",
        "asymmetric_damping",
    },
    "restoring": {
        "nonlinear_stiffness", "bilinear_stiffness", "end_stop", "backlash", "contact_loss",
        "cross_coupling",
    },
    "transduction": {"nonlinear_ratio", "position_periodic_force"},
    "drive": {"saturation", "slew_limit", "low_pass", "dead_zone", "inner_resistance"},
    "storage": {
        "leakage", "internal_leakage", "overflow", "added_mode", "linear_spring", "linear_loss",
        "linear_inertia", "linear_capacity", "eddy_current_loss", "self_heating",
    },
    "flow": {"square_root_flow", "nonlinear_resistance", "diode", "current_limit", "voltage_drop"},
    "measurement": {
        "sensor_lag", "sensor_offset", "sensor_gain", "sensor_drift", "sensor_nonlinearity",
        "sensor_rectification", "periodic_error", "quantisation",
    },
    "time": {"delay", "clock_skew"},
    "outside": {"external_disturbance", "time_varying_parameter", "unknown"},
}  # fmt: skip


def contract(v: dict[str, Any]) -> None:
    """Keys, types and vocabulary of ``bondsight.verdict/1``."""
    assert v["schema"] == "bondsight.verdict/1"
    assert {
        "schema", "verdict", "model", "recording", "findings", "fit", "nuisances", "advice",
        "remaining", "seconds", "seed",
    } <= set(v)  # fmt: skip
    assert v["verdict"] in VERDICTS
    assert isinstance(v["model"], str)
    assert set(v["recording"]) == {"name", "sha256", "samples", "channels"}
    assert len(v["recording"]["sha256"]) == 64
    assert set(v["fit"]) == {"noise_floor", "nominal", "repaired"}
    for part in ("nominal", "repaired"):
        assert set(v["fit"][part]) == {"train_rmse", "test_rmse"}
        for errors in v["fit"][part].values():
            assert all(e >= 0 for e in errors.values())
    assert all(f > 0 for f in v["fit"]["noise_floor"].values())
    for n in v["nuisances"]:
        assert set(n) - {"words", "over_noise"} == {
            "name", "value", "unit", "within_bounds", "ci95"
        }  # fmt: skip
        assert isinstance(n["within_bounds"], bool)
    for left in v["remaining"].values():
        assert set(left) == {"over_noise", "place", "kind", "regions"}
        assert left["over_noise"] is None or left["over_noise"] >= 0
        assert left["kind"] in {"", *PHYSICS}
        assert all(isinstance(t, str) for t in (*left["place"], *left["regions"]))
    assert set(v["remaining"]) <= set(v["fit"]["noise_floor"])
    assert all(isinstance(a, str) and "\n" not in a for a in v["advice"])
    assert all(isinstance(r, str) for r in v["regions"])
    for step in v["steps"]:
        assert set(step) == {"before", "reasons", "tried"}
        for t in step["tried"]:
            assert set(t) == {"effect", "element", "over_noise", "behind", "why"}
    assert isinstance(v["seconds"], int | float)
    assert isinstance(v["seed"], int)
    if v["verdict"] in ("explained", "parameters_only", "insufficient_data"):
        assert v["findings"] == []
    else:
        assert v["findings"]
    for f in v["findings"]:
        assert set(f) == {
            "location", "answer", "effect", "family", "kind", "law", "law_fit", "confidence",
            "probability", "parameters", "also_possible", "share_of_misfit_explained",
            "constants", "kind_words", "sentence", "formula",
        }  # fmt: skip
        assert f["answer"] in {"exact", "approximate", "family", "look_alikes", "kind", "unknown"}
        assert f["kind"] in {"", *PHYSICS}
        assert f["law_fit"] is None or 0 <= f["law_fit"] <= 1
        assert 0 <= f["probability"] <= 1
        assert f["effect"] == "unknown" or f["answer"] in {"exact", "approximate"}
        assert set(f["location"]) == {"element", "kind", "indistinguishable_from"}
        assert f["location"]["kind"] in KINDS
        assert f["location"]["element"] not in f["location"]["indistinguishable_from"]
        assert f["family"] in EFFECTS
        assert f["effect"] == "unknown" or f["effect"] in EFFECTS[f["family"]]
        assert 0 <= f["confidence"] <= 1
        for p in f["parameters"]:
            assert set(p) == {"name", "value", "unit", "ci95", "meaning"}
            assert len(p["ci95"]) == 2
        for p in f["constants"]:
            assert set(p) == {"name", "value", "unit", "meaning"}
        for p in f["also_possible"]:
            assert set(p) == {"effect", "element", "evidence"}
            assert any(p["effect"] in names for names in EFFECTS.values())


@pytest.mark.parametrize(
    ("kind", "n"),
    [("few", 1), ("few", 2), ("few", 3), ("constant", 600), ("no_excitation", 600)],
)
def test_too_little_to_go_on(
    kind: str, n: int, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, out = table(tmp_path, carriage(n, kind)), tmp_path / "out"
    code = main(
        ["diagnose", str(run), "--model", str(model), "--out", str(out), "--json", "--jobs", "1"]
    )
    captured = capsys.readouterr()
    assert (code, captured.err) == (0, "")
    written = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
    assert json.loads(captured.out) == written
    contract(written)
    assert written["verdict"] == "insufficient_data"
    assert written["findings"] == []
    assert written["advice"]
    assert "1 samples" not in captured.out
    assert written["recording"]["samples"] == n
    assert "</html>" in (out / "report.html").read_text(encoding="utf-8")
    assert sorted(p.name for p in out.iterdir()) == ["report.html", "verdict.json"]


@pytest.mark.slow
def test_a_finished_diagnosis_keeps_the_contract(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from bondgraph.laws import Coulomb
    from bondgraph.signals.recording import Recording
    from identification.diagnosis.catalogue import CATALOGUE
    from tests.settled import simulate

    few = [e for e in CATALOGUE if e.name in ("coulomb_friction", "delay", "quadratic_drag")]
    monkeypatch.setattr("identification.diagnosis.search.candidates.CATALOGUE", tuple(few))
    graph = load_model(str(model))
    t = np.asarray(0.01 * np.arange(900), np.float64)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    x = simulate(graph.with_element("d", law=Coulomb(0.8)), t, {"F": u})["x"]
    x = x + 2e-5 * np.random.default_rng(1).standard_normal(t.size)
    run = Recording("run", t, {"force": u, "place": x}, {"force": "N", "place": "m"}).write_csv(
        tmp_path / "run.csv"
    )
    out = tmp_path / "out"
    arguments = ["diagnose", str(run), "--model", str(model), "--out", str(out), "--jobs", "1"]
    assert main([*arguments, "--seed", "7", "--map", "x=place", "--map", "F=force"]) == 0
    captured = capsys.readouterr()
    # on a busy machine a line of progress every half minute
    assert all(re.match(r"\d+ s: ", line) for line in captured.err.splitlines())
    assert "Coulomb friction is missing at the resistor d" in captured.out
    v = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
    contract(v)
    assert v["verdict"] == "missing_physics"
    assert v["seed"] == 7
    (finding,) = v["findings"]
    assert finding["location"]["element"] == "d"
    low, high = finding["parameters"][0]["ci95"]
    assert low < 0.8 < high
    assert v["fit"]["repaired"]["test_rmse"]["x"] < 0.1 * v["fit"]["nominal"]["test_rmse"]["x"]


def test_vocabulary_of_the_catalogue() -> None:
    from identification.diagnosis.catalogue import CATALOGUE, UNNAMED

    for e in (*CATALOGUE, UNNAMED):
        assert e.name in EFFECTS[e.family], e.name
