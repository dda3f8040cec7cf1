"""The command: one line for anything unusable, a written verdict for anything else."""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.models.catalogue import LOADED, MODELS
from actuators.models.opening import load_model, model_name
from bondgraph import BondGraph
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph import sensors
from bondgraph.signals.files.any_file import read_table
from bondsight.cli.checkout import VERBS
from bondsight.cli.main import _parser, main
from identification import datasets as data
from identification.datasets.opening import open_recording

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
    },
    "transduction": {"nonlinear_ratio", "position_periodic_force"},
    "drive": {"saturation", "slew_limit", "low_pass", "dead_zone"},
    "storage": {"leakage", "overflow", "added_mode", "self_heating"},
    "flow": {"square_root_flow", "nonlinear_resistance", "diode"},
    "measurement": {
        "sensor_lag", "sensor_offset", "sensor_gain", "sensor_drift", "sensor_nonlinearity",
        "sensor_rectification", "periodic_error", "quantisation",
    },
    "time": {"delay", "clock_skew"},
    "outside": {"external_disturbance", "time_varying_parameter", "unknown"},
}  # fmt: skip

GOOD = """
from bondgraph import BondGraph, C, Dq, I, One, R, Se

def model():
    with BondGraph("carriage") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        v >> R("d", 2.0, unit="N*s/m")
        v >> C("k", stiffness=200.0, unit="N/m")
        v >> Dq("x", unit="m")
    return g
"""
UNCONNECTED = """
from bondgraph import BondGraph, C, Dq, I, One, Se

def model():
    with BondGraph("apart") as g:
        v, w = One("v"), One("w")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        w >> C("k", stiffness=200.0, unit="N/m")
        w >> Dq("x", unit="m")
    return g
"""
CONFLICT = """
from bondgraph import BondGraph, Dq, I, One, Se, Sf

def model():
    with BondGraph("fight") as g:
        v = One("v")
        Sf("u", unit="m/s") >> v
        Sf("w", unit="m/s") >> v
        v >> I("m", 1.0, unit="kg")
        v >> Dq("x", unit="m")
    return g
"""
TYPO = GOOD.replace("    return g", '    g["kk"]\n    return g')
SENSORLESS = GOOD.replace('        v >> Dq("x", unit="m")\n', "")
MODEL_FILES: Mapping[str, tuple[str, str]] = {
    "unconnected": (UNCONNECTED, "bond them"),
    "conflict": (CONFLICT, "fight"),
    "typo": (TYPO, "Did you mean 'k'"),
    "value_error": ("def model():\n    raise ValueError('two\\nlines')\n", "ValueError"),
    "syntax_error": ("def model(:\n", "SyntaxError at line 1"),
    "exits": ("import sys\nsys.exit(3)\n", "SystemExit"),
    "exits_inside": ("def model():\n    raise SystemExit\n", "SystemExit"),
    "import_error": ("import no_such_package_here\n", "no_such_package_here"),
    "returns_none": ("def model():\n    return None\n", "NoneType"),
    "returns_class": (GOOD + "\nmodel = dict\n", "dict"),
    "no_factory": ("def modell():\n    pass\n", "Did you mean 'modell'"),
    "not_callable": ("model = 3\n", "no function 'model'"),
    "no_sensor": (SENSORLESS, "sensor"),
    "empty": ("", "no function 'model'"),
    "arguments": ("def model(a):\n    return a\n", "TypeError"),
}
ROWS = "\n".join(
    f"{0.01 * i:.2f},{np.sin(0.3 * i):.6f},{0.1 * np.sin(0.3 * i - 1):.6f}" for i in range(60)
)
HEAD = "t_s,F[N],x[mm]\n"


@pytest.fixture
def model(tmp_path: Path) -> Path:
    file = tmp_path / "carriage.py"
    file.write_text(GOOD, encoding="utf-8")
    return file


def table(folder: Path, text: str | bytes, name: str = "run.csv") -> Path:
    file = folder / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


def refused(capsys: pytest.CaptureFixture[str], out: Path | None, *arguments: str) -> str:
    """Run, check the form of the refusal, return its line."""
    more = () if out is None else ("--out", str(out))
    try:
        code = main([*arguments, *more])
    except SystemExit as stop:  # argparse
        code = int(str(stop.code))
    captured = capsys.readouterr()
    assert code == 2, captured
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert len(lines) == 1, captured.err
    assert lines[0].startswith("bondsight: ")
    assert "Traceback" not in lines[0]
    if out is not None and out.is_dir():
        assert not list(out.iterdir())
    return lines[0]


@pytest.mark.parametrize("case", MODEL_FILES)
def test_unusable_model_file(case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, said = MODEL_FILES[case]
    file = tmp_path / f"{case}.py"
    file.write_text(text, encoding="utf-8")
    run = table(tmp_path, HEAD.replace("x[mm]", "x[mm]") + ROWS)
    line = refused(capsys, tmp_path / "out", "diagnose", str(run), "--model", str(file))
    assert said in line


@pytest.mark.parametrize(
    ("verb", "case"),
    [
        *((v, c) for v in ("check", "equations") for c in ("conflict", "unconnected")),
        *((v, c) for v in ("check", "equations", "draw") for c in ("value_error", "returns_none")),
    ],
)  # fmt: skip
def test_other_verbs_refuse_it_too(
    verb: str, case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    file = tmp_path / f"{case}.py"
    file.write_text(MODEL_FILES[case][0], encoding="utf-8")
    code = main([verb, str(file)])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.err.count("\n") >= 1
    assert "Traceback" not in captured.err
    assert [p.name for p in tmp_path.iterdir() if p.suffix == ".svg"] == []


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("resonatr", "Did you mean 'resonator'"),
        ("actuators.models.textbook:resonato", "resonator"),
        ("no_such_module:model", "no_such_module"), ("missing.py", "does not exist"),
        ("", "no model"),
        (":", "model"), ("actuators.models.textbook:", "function"), ("os:getcwd", "str"),
    ],
)  # fmt: skip
def test_unknown_model(
    name: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = table(tmp_path, HEAD + ROWS)
    assert said in refused(capsys, tmp_path / "out", "diagnose", str(run), "--model", name)


RECORDINGS: Mapping[str, tuple[str | bytes, str]] = {
    "empty": ("", "empty"),
    "header_only": (HEAD, "no row"),
    "binary": (bytes(range(256)) * 8, "binary"),
    "random_bytes": (b"\x89PNG\r\n\x1a\n" + bytes(300), "binary"),
    "no_unit": ("t_s,F[N],x\n" + ROWS, "no unit"),
    "unknown_unit": ("t_s,F[N],x[parsecks]\n" + ROWS, "parsecks"),
    "nan": (HEAD + ROWS.replace("0.05,", "0.05,nan,", 1).replace("nan," + "0", "nan,0", 1), "row"),
    "nan_cell": (HEAD + ROWS + "\n0.60,nan,0.1\n", "NaN"),
    "empty_cell": (HEAD + ROWS + "\n0.60,,0.1\n", "empty"),
    "infinite": (HEAD + ROWS + "\n0.60,1,inf\n", "infinite"),
    "text_cell": (HEAD + ROWS + "\n0.60,one,0.1\n", "not a number"),
    "duplicate": (HEAD + ROWS + "\n0.59,1,0.1\n", "repeats"),
    "backwards": (HEAD + ROWS + "\n0.10,1,0.1\n", "earlier"),
    "gap": (HEAD + ROWS + "\n9.00,1,0.1\n", "uneven"),
    "ragged": (HEAD + ROWS + "\n0.60,1\n", "cells"),
    "no_header": (ROWS, "header"),
    "sensor_absent": ("t_s,F[N],T[degC]\n" + ROWS, "'x'"),
    "input_absent": ("t_s,G[V],x[mm]\n" + ROWS, "'F'"),
    "near_name": ("t_s,F[N],x_1[kg]\n" + ROWS, "--map x="),
    "wrong_dimension": ("t_s,F[N],x[kg]\n" + ROWS, "kg"),
}


@pytest.mark.parametrize("case", RECORDINGS)
def test_unusable_recording(
    case: str, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, said = RECORDINGS[case]
    run = table(tmp_path, text)
    line = refused(capsys, tmp_path / "out", "diagnose", str(run), "--model", str(model))
    assert said in line


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nowhere.csv", "no such file"), ("piezo-actuater-sine", "piezo-actuator-sine"),
        ("run.xyz", "'.xyz'"), (".", "not a file"), ("broken.npz", "broken.npz"),
        ("broken.mat", "broken.mat"), ("", "known"),
    ],
)  # fmt: skip
def test_unreadable_recording(
    name: str, said: str, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for broken in ("run.xyz", "broken.npz", "broken.mat"):
        table(tmp_path, b"this is no array file", broken)
    line = refused(capsys, tmp_path / "out", "diagnose", name, "--model", str(model))
    assert said in line


def test_known_recording_that_is_absent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(data.FOLDER_VARIABLE, str(tmp_path))
    line = refused(
        capsys, tmp_path / "out", "diagnose", "emps", "--model", "mass_with_viscous_friction"
    )
    assert data.FOLDER_VARIABLE in line


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("x", "NAME=COLUMN"), ("=x", "NAME=COLUMN"), ("x=", "NAME=COLUMN"), ("", "NAME=COLUMN"),
        (" = ", "NAME=COLUMN"), ("x=y", "'y'"), ("x=F[parsecks]", "parsecks"), ("t=F", "F"),
    ],
)  # fmt: skip
def test_malformed_map(
    given: str, said: str, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = table(tmp_path, HEAD + ROWS)
    line = refused(
        capsys, tmp_path / "out", "diagnose", str(run), "--model", str(model), "--map", given
    )
    assert said in line


MOTOR = """
from bondsight import BondGraph, Df, GY, I, MSe, One, R, Se

def model():
    with BondGraph("motor") as g:
        arm, rotor = One("arm"), One("rotor")
        Se("u", unit="V") >> arm >> I("L", 2.5e-3, unit="H")
        arm >> R("Ra", 0.8, unit="ohm")
        arm >> Df("i", unit="A")
        arm >> GY("k", ratio=0.12, unit="N*m/A") >> rotor
        rotor >> I("J", 6e-4, unit="kg*m2")
        rotor >> Df("w", unit="rad/s")
        MSe("load", -2.0, unit="N*m") >> rotor
    return g
"""
LOGGED = "time_ms,voltage_V,current_A,speed_rpm"


@pytest.mark.parametrize(
    ("header", "maps", "said"),
    [
        (LOGGED, ["i=speed_rpm"], "i is in A, that column of run in rpm; in A is current"),
        (LOGGED, ["i=voltage_V"], "i is in A, that column of run in V; in A is current"),
        (LOGGED, ["u=current_A"], "u is in V, that column of run in A; in V is voltage"),
        (LOGGED, ["q=speed_rpm"], "Known: u, i, w"),
        (LOGGED, ["load=speed_rpm"], "load has no channel, the model motor gives its value"),
        ("time_ms,voltage,current,speed", [], "'voltage[V]' ('1' for a pure number), or say it "
         "with --map 'u=voltage[V]'; other names of motor: i [A], w [rad/s]"),
        ("time_ms,voltage_V,current,speed", ["i=current"], "--map 'i=current[A]'"),
        ("time_ms,voltage_V,w,current_A", [], "--map 'w=w[rad/s]'"),
        ("time_ms,voltage_V,current_A,brake_A,speed_rpm", [],
         "current and brake are in A; choose one with --map i=current"),
    ],
)  # fmt: skip
def test_a_column_that_fits_no_channel(
    header: str, maps: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    width = header.count(",")
    rows = "".join(f"{2 * k}{f',{k % 7}' * width}\n" for k in range(60))
    run, motor = table(tmp_path, f"{header}\n{rows}"), table(tmp_path, MOTOR, "motor.py")
    words = [word for m in maps for word in ("--map", m)]
    line = refused(
        capsys, tmp_path / "out", "diagnose", str(run), "--model", str(motor), *words
    )  # fmt: skip
    assert line.endswith(said) if said.startswith("Known") else said in line


def test_folder_that_cannot_be_written(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = table(tmp_path, HEAD + ROWS)
    blocked = table(tmp_path, "a file", "blocked")
    for out in (blocked, blocked / "deeper"):
        line = refused(capsys, out, "diagnose", str(run), "--model", str(model))
        assert "cannot write" in line
        assert "--out" in line
        line = refused(capsys, out, "demo", "--seed", "1", "--effect", "none")
        assert "cannot write" in line
    assert blocked.read_text(encoding="utf-8") == "a file"
    line = refused(capsys, blocked / "d.svg", "draw", str(model))
    assert "cannot write" in line


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_folder_without_permission(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, out = table(tmp_path, HEAD + ROWS), tmp_path / "locked"
    out.mkdir(mode=0o500)
    assert "permission" in refused(capsys, out, "diagnose", str(run), "--model", str(model))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("demo", "--effect", "quadratic_dragg"), "Did you mean 'quadratic_drag'"),
        (("demo", "--seeds", "0"), "at least one"),
        (("demo", "--seed", "-1", "--effect", "none"), "-1"),
        (("demo", "--jobs", "0", "--seed", "1"), "--jobs"),
        (("demo", "--seeds", "2", "--first", "-5"), "-5"),
    ],
)
def test_unusable_demo(
    arguments: tuple[str, ...], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said in refused(capsys, tmp_path / "out", *arguments)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("diagnose", "run.csv"), "--model"),
        (("diagnoze",), "no 'diagnoze' (did you mean 'diagnose'?); see bondsight"),
        (("diagnose", "run.csv", "--model", "resonator", "--hold", "spline"), "linear"),
        (("diagnose", "run.csv", "--model", "resonator", "--jobs", "many"), "many"),
        (("diagnose", "run.csv", "--model", "resonator", "--jobs", "0"), "--jobs"),
        (("diagnose", "run.csv", "--model", "resonator", "--jobs", "-3"), "--jobs"),
        (("diagnose", "run.csv", "--model", "resonator", "--nois", "x=1"), "--nois"),
        (("diagnose", "run.csv", "--model", "resonator", "--moddel", "x"), "--moddel"),
        (("diagnose", "--model", "resonator"), "RECORDING"),
        (("diagnose", "run.csv", "--model", "resonator", "--effects", "0"), "--effects"),
        *((("diagnose", "run.csv", "--model", "resonator", "--effects", n), "number of at least 1")
          for n in ("0", "-1", "two")),
        *((("fit", "run.csv", "--model", "resonator", o, "0"), f"{o}: '0' is not a whole number")
          for o in ("--starts", "--iterations")),
        *((("fit", "run.csv", "--model", "resonator", "--clock", n), "is not 0 to 1e5 ppm")
          for n in ("-5", "nan", "1e5", "slow")),
        (("diagnose", "run.csv", "--model", "resonator", "--without", "dilay"), "'delay'"),
        (("bench", "derivationn"), "derivation"),
        (("equations", "resonatr"), "resonator"), (("check", "resonatr"), "resonator"),
    ],
)  # fmt: skip
def test_unusable_arguments(
    arguments: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said in refused(capsys, None, *arguments)


def test_a_folder_without_a_verdict(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    said = refused(capsys, None, "studio", str(folder), "--model", str(model))
    assert "holds no verdict.json" in said


def test_a_model_that_is_cut_off(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "model.json"
    file.write_text('{"format": "bondsight", "elements": [{"kind": "1", "na', encoding="utf-8")
    assert "seems cut off" in refused(capsys, None, "check", str(file))


def test_a_model_without_a_sensor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "blind.py"
    file.write_text(
        "from bondsight import BondGraph, One, R, Se\n"
        "def model():\n"
        "    with BondGraph('blind') as g:\n"
        "        Se('F') >> (loop := One('loop')) >> R('d', 2.0)\n"
        "    return g\n",
        encoding="utf-8",
    )
    assert main(["check", str(file)]) == 0
    said = capsys.readouterr().out
    assert "it has no sensor" in said
    named = re.findall(r"\b(?:D[a-z]|Reading)\b", said)
    assert len(named) == 5
    assert all(issubclass(getattr(sensors, n), sensors.Sensor) for n in named)


# -- too little to go on: a verdict, not an error ---------------------------------------------
def carriage(n: int, kind: str) -> str:
    t = 0.01 * np.arange(n)
    rng = np.random.default_rng(3)
    force = np.sin(3 * t) if kind != "no_excitation" else np.zeros(n)
    x = np.full(n, 0.5) if kind == "constant" else 0.1 * np.sin(3 * t)
    if kind == "no_excitation":
        x = 1e-3 * rng.standard_normal(n)
    return HEAD + "\n".join(
        f"{a:.3f},{b!r},{c!r}" for a, b, c in zip(t, map(float, force), map(float, x), strict=True)
    )


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


def test_a_map_keeps_the_channels_that_need_none(model: Path, tmp_path: Path) -> None:
    graph = load_model(str(model))
    run = table(tmp_path, (HEAD + ROWS).replace("x[mm]", "place_mm"))
    recording, _, said = open_recording(str(run), graph, {"x": "place_mm"})
    assert sorted(recording.channels) == ["F", "x"]
    assert said == ()
    without_unit = table(tmp_path, (HEAD + ROWS).replace("F[N],x[mm]", "F,place_mm"), "bare.csv")
    recording, _, _ = open_recording(str(without_unit), graph, {"x": "place_mm"})
    assert sorted(recording.channels) == ["x"]


def test_a_map_reads_the_file_once_and_keeps_equal_columns(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = load_model(str(model))
    rows = "".join(f"{0.01 * i:.2f},{i % 2},{i},{i}\n" for i in range(40))
    run = table(tmp_path, "t_s,F[N],place[m],copy[m]\n" + rows)
    read: list[Path] = []

    def counted(file: Path, *more: Any) -> Any:
        read.append(file)
        return read_table(file, *more)

    monkeypatch.setattr("bondgraph.signals.recording.read_table", counted)
    recording, _, _ = open_recording(str(run), graph, {"x": "place"})
    assert read == [run]
    assert list(recording.channels) == ["x", "F", "copy"]
    kept = recording.save(tmp_path / "kept.npz")
    again, _, _ = open_recording(str(kept), graph, {"x": "copy"})
    assert list(again.channels) == ["x", "F"]
    broken = table(
        tmp_path, "t_s,F[N],place[m],copy[m]\n" + rows.replace(",7\n", ",nan\n"), "b.csv"
    )
    recording, _, _ = open_recording(str(broken), graph, {"x": "place"})
    assert list(recording.channels) == ["x"]


def test_a_model_file_is_called_by_its_name_in_reports(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, out = table(tmp_path, carriage(8, "few")), tmp_path / "out"
    graph = load_model(str(model))
    saved = tmp_path / "kept.json"
    saved.write_text(to_json(graph), encoding="utf-8")
    for given in (model, saved):
        assert main(["diagnose", str(run), "--model", str(given), "--out", str(out)]) == 0
        assert str(given) not in capsys.readouterr().out
        page = (out / "report.html").read_text(encoding="utf-8")
        assert f"<title>Diagnosis of {graph.name} on run</title>" in page
        assert str(given) not in page
        assert json.loads((out / "verdict.json").read_text("utf-8"))["model"] == graph.name
    assert model_name("stack_bond_graph", graph) == "stack_bond_graph"
    assert model_name("actuators.x:y", graph) == "actuators.x:y"
    assert model_name("a/wheel.py", BondGraph("")) == "wheel"


def test_several_recordings_are_diagnosed_together(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two = (table(tmp_path, carriage(8, "few"), f"{name}.csv") for name in ("one", "two"))
    out = tmp_path / "out"
    arguments = ["diagnose", str(one), str(two), "--model", str(model), "--out", str(out)]
    assert main([*arguments, "--json", "--jobs", "1", "--without", "delay", "--effects", "1"]) == 0
    written = json.loads(capsys.readouterr().out)
    assert written["verdict"] == "insufficient_data"
    assert written["recording"]["name"] == "one + two"
    assert written["recording"]["samples"] == 16


def test_several_recordings_need_the_same_channels(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = table(tmp_path, HEAD + ROWS, "one.csv")
    two = table(tmp_path, (HEAD + ROWS).replace("x[mm]", "y[kg]"), "two.csv")
    said = refused(capsys, tmp_path / "o", "diagnose", str(one), str(two), "--model", str(model))
    assert "two has no channel x" in said


# -- the contract of verdict.json -------------------------------------------------------------
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
        assert set(n) == {"name", "value", "unit", "within_bounds"}
        assert isinstance(n["within_bounds"], bool)
    for left in v["remaining"].values():
        assert set(left) == {"over_noise", "place", "kind", "regions"}
        assert left["over_noise"] is None or left["over_noise"] >= 0
        assert left["kind"] in {"", *PHYSICS}
        assert all(isinstance(t, str) for t in (*left["place"], *left["regions"]))
    assert set(v["remaining"]) <= set(v["fit"]["noise_floor"])
    assert all(isinstance(a, str) and "\n" not in a for a in v["advice"])
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
            "constants", "kind_words", "sentence",
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
            assert set(p) == {"name", "value", "unit", "ci95"}
            assert len(p["ci95"]) == 2
        for p in f["constants"]:
            assert set(p) == {"name", "value", "unit"}
        for p in f["also_possible"]:
            assert set(p) == {"effect", "element", "evidence"}
            assert any(p["effect"] in names for names in EFFECTS.values())


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
    assert captured.err == ""
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


@pytest.mark.parametrize("name", MODELS)
def test_catalogue_models_can_be_checked_and_drawn(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", name]) == 0
    assert "sound" in capsys.readouterr().out
    target = tmp_path / f"{name}.svg"
    assert main(["draw", name, "--out", str(target)]) == 0
    assert target.read_text(encoding="utf-8").startswith("<")
    assert main(["equations", name]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("name", [n for n in MODELS if n in LOADED])
def test_equations_hold_the_external_force(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Its omission in (5.4) is listed as an error of the thesis."""
    assert main(["equations", name]) == 0
    text = capsys.readouterr().out
    assert re.search(r"\bF_e\b", text)
    if name == "stack_bond_graph":
        assert "e_m := e_F_e - e_R_nl - e_force" in text


def test_without_a_verb_the_help_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "diagnose" in capsys.readouterr().out


def options_of(parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.Action]]:
    """Return every option of a parser and of its sub-parsers, with the words that lead to it."""
    for a in parser._actions:
        if isinstance(a, argparse._SubParsersAction):
            for sub in a.choices.values():
                yield from options_of(sub)
        elif a.option_strings:
            yield f"{parser.prog} {a.option_strings[-1]}", a


def test_no_list_forgets_what_was_given_before() -> None:
    """An option that takes several words adds to them where it is given again."""
    called = ("", *VERBS)  # a verb of the developers is known when it is called
    lists = {n: a for c in called for n, a in options_of(_parser(c)) if a.nargs in ("+", "*")}
    assert {"bondsight fit --free", "bondsight coverage --intervals"} <= set(lists)
    forgetful = [n for n, a in lists.items() if not isinstance(a, argparse._ExtendAction)]
    assert forgetful == []


@pytest.mark.parametrize(
    ("words", "name", "expected"),
    [
        ("fit r.csv --model m --free a b --free c", "free", ["a", "b", "c"]),
        ("fit r.csv --model m --own a --own b", "own", ["a", "b"]),
        ("fit r.csv --model m --validate a --validate b", "validate", ["a", "b"]),
        ("fit r.csv --model m", "free", None),
        ("identifiability m --free a --free b", "free", ["a", "b"]),
        ("coverage demo --intervals fisher --intervals profile", "intervals",
         ["fisher", "profile"]),
        ("diagnose r.csv --model m --without a --without b", "without", ["a", "b"]),
    ],
)  # fmt: skip
def test_repeated_options_add_up(words: str, name: str, expected: list[str] | None) -> None:
    for _ in range(2):  # nothing is kept from one parsing to the next
        assert getattr(_parser(words.split()[0]).parse_args(words.split()), name) == expected


def test_the_help_loads_nothing_heavy() -> None:
    heavy = ("numpy", "scipy", "sympy", "casadi", "matplotlib", "pandas")
    code = (
        "import sys\nfrom bondsight.cli.main import _parser\n_parser().format_help()\n"
        f"print([m for m in {heavy!r} if m in sys.modules])"
    )
    said = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).resolve().parents[2],
    )
    assert said.stdout.strip() == "[]"
