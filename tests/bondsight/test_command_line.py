"""The command: what it reads, what its verbs print, its help."""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from actuators.models.catalogue import LOADED, MODELS
from actuators.models.opening import load_model, model_name
from bondgraph import BondGraph
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.signals.files.any_file import read_table
from bondsight.cli.checkout import VERBS
from bondsight.cli.main import _parser, main
from identification.datasets.opening import open_recording
from tests.bondsight.carriage_files import HEAD, ROWS, carriage, refused, table


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
