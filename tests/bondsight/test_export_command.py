"""The commands that write models for other tools: whole files, read by those tools."""

from __future__ import annotations

import argparse
import json
import runpy
import shutil
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.models.catalogue import MODELS
from actuators.models.opening import load_model
from bondgraph import BondGraph, UnknownName, UnusableInput
from bondgraph.export.formats import FORMATS, export
from bondgraph.export.notations import NOTATIONS, notation
from bondsight.cli.export import add_export_command
from tests.settled import simulate
from tests.spring import spring

LINEAR, MEMORY = "stack_with_payload", "stack_ang"
ALL = tuple(FORMATS)


def command(*words: str) -> int:
    parser = argparse.ArgumentParser(prog="bondsight")
    add_export_command(parser.add_subparsers())
    options = parser.parse_args(["export", *words])
    return int(options.run(options))


def carriage(name: str = "carriage") -> BondGraph:
    return spring(name=name)


@pytest.mark.parametrize("name", ALL)
def test_every_format_names_its_files_and_leaves_nothing_else(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command(LINEAR, "--format", name) == 0
    printed = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert printed
    found = sorted(p.relative_to(tmp_path) for p in tmp_path.rglob("*") if p.is_file())
    assert found == sorted(printed)
    for file in found:
        assert file.stat().st_size > 100
        assert file.stat().st_mode & 0o777 == 0o644
    first = FORMATS[name].default.format("stack_bond_graph")
    assert printed[0].parts[0] == first


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", ALL)
def test_existing_files_are_replaced_whole_or_kept(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "deep" / "er" / "file"
    graph = MODELS[LINEAR]()
    first = {p: p.read_bytes() for p in export(graph, name, out)}
    for p in first:
        p.write_bytes(b"old")
    assert {p: p.read_bytes() for p in export(graph, name, out)} == first

    def fail(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    for p in first:
        p.write_bytes(b"old")
    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(UnusableInput, match="No space"):
        export(graph, name, out)
    assert {p.read_bytes() for p in first} == {b"old"}
    left = {p for p in out.parent.rglob("*") if p.is_file()}
    assert left == set(first)


def test_a_model_the_format_cannot_hold_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match="V_in has memory") as caught:
        command(MEMORY, "--format", "control", "--out", str(tmp_path / "x.py"))
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_takes_the_default_name(tmp_path: Path) -> None:
    (written,) = export(carriage(), "latex", tmp_path)
    assert written == tmp_path / "carriage.tex"


def test_list_needs_no_model(capsys: pytest.CaptureFixture[str]) -> None:
    assert command("--list") == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(ALL)


def test_missing_words_are_named_in_one_line() -> None:
    with pytest.raises(UnusableInput, match=r"needs --format: .*numpy\|c\|casadi"):
        command(LINEAR)
    with pytest.raises(UnusableInput, match="needs MODEL"):
        command("--format", "json")
    with pytest.raises(UnknownName, match="no format 'matlab'"):
        export(carriage(), "matlab")
    with pytest.raises(UnknownName, match=r"no notation 'Latex'.*Did you mean 'latex'"):
        notation(carriage(), "Latex")


def test_the_model_file_is_not_overwritten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    export(carriage(), "json")
    before = Path("carriage.json").read_bytes()
    with pytest.raises(UnusableInput, match="is the model itself; give another --out"):
        command("carriage.json", "--format", "json")
    assert Path("carriage.json").read_bytes() == before


@pytest.mark.parametrize("name", ["../../evil", "/etc/passwd", "a b;c", "..", "\u6f22"])
def test_names_of_models_are_no_paths(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside = tmp_path / "a" / "b"
    inside.mkdir(parents=True)
    monkeypatch.chdir(inside)
    (file,) = export(carriage(name), "latex")
    assert file.resolve().parent == inside
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == [inside / file.name]


def test_c_needs_a_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(UnusableInput, match="C needs a folder"):
        export(carriage(), "c", tmp_path / "file")
    assert (tmp_path / "file").read_text() == "mine"


def test_numpy_module_runs_alone(tmp_path: Path) -> None:
    (file,) = export(carriage(), "numpy", tmp_path)
    module = runpy.run_path(str(file))
    assert module["INPUTS"] == ("F",)
    assert callable(module["simulate"])


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler")
def test_c_compiles_without_a_warning(tmp_path: Path) -> None:
    files = export(carriage(), "c", tmp_path / "c")
    sources = [str(f) for f in files if f.suffix == ".c"]
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O0", "-o", str(tmp_path / "run")]
    run = subprocess.run(["gcc", *flags, *sources, "-lm"], capture_output=True, check=False)
    assert run.returncode == 0, run.stderr.decode()


def test_casadi_file_is_a_model_again(tmp_path: Path) -> None:
    from bondgraph.export.casadi_function import load

    (file,) = export(carriage(), "casadi", tmp_path)
    model = load(file)
    dx = model.rhs(x=[0.1, 0.5], u=3.0, p=model.parameters())["dx"].full().ravel()
    by_name = dict(zip(model.names.states, dx, strict=True))
    q = 0.1 if model.names.states[0].startswith("q") else 0.5
    p = 0.6 - q
    assert by_name["p_m"] == pytest.approx(3.0 - 2.0 * p / 0.5 - 200.0 * q)


@pytest.mark.parametrize(("name", "version"), [("fmu2-cs", "2.0"), ("fmu3-me", "3.0")])
def test_fmus_are_valid(name: str, version: str, tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy")
    (file,) = export(carriage(), name, tmp_path)
    assert zipfile.ZipFile(file).testzip() is None
    description = fmpy.read_model_description(str(file), validate=True)
    assert description.fmiVersion.startswith(version)
    assert {"F", "x"} <= {v.name for v in description.modelVariables}


def test_control_module_is_the_model(tmp_path: Path) -> None:
    ct = pytest.importorskip("control")
    (file,) = export(carriage(), "control", tmp_path)
    system = runpy.run_path(str(file))["system"]()
    time = np.linspace(0.0, 1.0, 501)
    force = np.sin(20 * time)
    expected = simulate(carriage(), time, {"F": force}, x0=np.zeros(2))["x"]
    assert ct.forced_response(system, time, force).outputs == pytest.approx(expected, abs=1e-9)
    assert system.output_labels == ["x"]


@pytest.mark.parametrize("model", [LINEAR, MEMORY, "stack_bond_graph_ang"])
def test_json_is_the_same_graph(model: str, tmp_path: Path) -> None:
    (file,) = export(MODELS[model](), "json", tmp_path)
    again = load_model(str(file))
    assert list(again.elements) == list(MODELS[model]().elements)
    assert notation(again, "ordered") == notation(MODELS[model](), "ordered")
    assert json.loads(file.read_text())["schema"].startswith("bondsight-graph/")


@pytest.mark.parametrize("kind", tuple(NOTATIONS))
@pytest.mark.parametrize("model", [LINEAR, MEMORY])
def test_every_notation_prints_every_model(kind: str, model: str) -> None:
    text = notation(MODELS[model](), kind)
    assert len(text) > 10
    assert not text.endswith("\n")


def test_text_names_everything() -> None:
    text = notation(MODELS[LINEAR](), "text")
    for part in ("R_e = 20 ohm", "outputs: ", "x [m]", "i [A]", "inputs: V_in", "dp_m/dt := "):
        assert part in text
    assert "operator(c_V_in; 12 numbers of memory)" in notation(MODELS[MEMORY](), "text")


def test_exports_agree_with_the_printed_notations(tmp_path: Path) -> None:
    graph = carriage()
    for name in ("numpy", "modelica", "json"):
        (file,) = export(graph, name, tmp_path)
        assert file.read_text(encoding="utf-8").rstrip("\n") == notation(graph, name)
    for file in export(graph, "c", tmp_path / "c"):
        assert file.read_text(encoding="utf-8").rstrip("\n") in notation(graph, "c")
