"""Whatever cannot be used is refused in one line, and nothing is written."""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from bondgraph.graph import sensors
from bondsight.cli import studio
from bondsight.cli.main import main
from identification import datasets as data
from tests.bondsight.carriage_files import HEAD, MODEL_FILES, ROWS, refused, table


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
        (LOGGED, ["u=current_A", "i=voltage_V"], "that column of run in A; in V is voltage"),
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
        (("demo", "--plant", "motr"), "Did you mean 'motor'"),
        (("demo", "--plant", "table"), "no plant 'table' in the demo"),
        (("demo", "--plant", "motor", "--effect", "overflow"), "take --plant tanks"),
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
        (("fit", "run.csv", "--model", "resonator", "--starts", "4", "--optimiser", "ipopt"),
         "--starts runs single_shooting with gauss_newton, not with ipopt"),
        (("compensate", "--controller", "c.toml"), "--controller need an identified stack first"),
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


@pytest.mark.parametrize(("given", "taken"), [((), 7), (("--seed", "3"), 3), (("--seed", "0"), 0)])
def test_the_studio_takes_the_seed_of_the_verdict_where_none_is_given(
    given: tuple[str, ...], taken: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[int] = []
    monkeypatch.setattr(studio, "recordings_of", lambda folder: ([str(folder / "run.csv")], 7))

    def diagnosed(options: argparse.Namespace) -> tuple[int, None]:
        seen.append(options.seed)
        return 0, None

    monkeypatch.setattr(studio, "diagnose_files", diagnosed)
    assert main(["studio", str(tmp_path), "--model", "resonator", *given]) == 0
    assert main(["studio", "run.csv", "--model", "resonator"]) == 0
    assert seen == [taken, 0]


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


@pytest.mark.parametrize(("word", "where"), [("simulate", "in Python"), ("identify", "fit")])
def test_a_verb_that_is_elsewhere_is_shown_there(
    word: str, where: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([word, "model"])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert f"no {word!r}: " in said
    assert where in said
    assert "did you mean" not in said
