"""A line of the library names arguments; at the shell the same line names options."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from actuators.models.opening import load_model
from bondgraph.signals.files.checks import map_argument
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from bondsight.cli.main import main
from bondsight.cli.spoken import as_options
from tests.bondsight.carriage_files import HEAD, ROWS, table
from tests.settled import simulate


@pytest.mark.parametrize(
    ("said", "at_shell"),
    [
        (map_argument("x", "it's[m]"), "--map 'x=it'\"'\"'s[m]'"),
        (map_argument("x"), "--map x=COLUMN"),
        (map_argument("X", "COLUMNS"), "--map X=COLUMNS"),
        ("map={NAME: COLUMN}", "--map NAME=COLUMN"),
        ("recording.select({'x': 'p', '*': '*'})", "--map x=p"),
        ("the rate (fs=HZ) if", "the rate (--fs HZ) if"),
        ("map={'F': 'COLUMN[N]', 'x': 'a b'}", "--map 'F=COLUMN[N]' --map 'x=a b'"),
        ("noise={SENSOR: VALUE}", "--noise SENSOR=VALUE"), ("noise={'x': 1}", "noise={'x': 1}"),
        ("rows=(3, 9)", "--rows 3:9"), ("(resample=12.5)", "(--resample 12.5)"),
        ("method='multiple_shooting' or many_starts", "--method multiple_shooting or --starts 32"),
        ("noise='coloured' fits the colour", "--noise coloured fits the colour"),
        ("by Nuisances(offsets=False) or initial={'q_x': value}", "by --no-offsets"),
        ("or Nuisances(commands=True)", "or --command-offsets"),
        ("leave out fs=, fill=", "leave out --fs, --fill"),
        ("map={'w': COLUMN} or Recording.select, or leave it out of the model: graph.remove('w')",
         "--map w=COLUMN, or leave it out of the model"),
        ("too narrow; estimate(found.study.changed(n_sub=None)) corrects it", "too narrow"),
        ("(select --map x=y), offs=3, --fs 1000", "(select --map x=y), offs=3, --fs 1000"),
    ],
)  # fmt: skip
def test_arguments_become_options(said: str, at_shell: str) -> None:
    assert as_options(said) == at_shell


@pytest.mark.parametrize(
    ("text", "python", "shell"),
    [
        (HEAD.replace("x[mm]", "x") + ROWS, "map={'x': 'x[N]'}", "--map 'x=x[m]'"),
        (HEAD.replace("t_s", "clock_V") + ROWS, "fs=HZ", "--fs HZ"),
        (HEAD + ROWS + "\n9.00,1,0.1\n", "rows=(FIRST, LAST)", "--rows FIRST:LAST"),
        (HEAD + ROWS + "\n0.60,nan,0.1\n", "rows=(2, ", "--rows 2:"),
    ],
)  # fmt: skip
def test_each_reader_hears_its_own_words(
    text: str, python: str, shell: str, model: Path, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    run = table(tmp_path, text)
    with pytest.raises(UnusableInput) as refused:
        Recording.read(run)
    assert python in str(refused.value)
    assert "--" not in str(refused.value)
    assert main(["diagnose", str(run), "--model", str(model), "--out", str(tmp_path / "o")]) == 2
    line = capsys.readouterr().err
    assert shell in line
    assert "map=" not in line
    assert "fs=" not in line


def test_a_sensor_without_a_column_at_the_shell(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = table(tmp_path, HEAD.replace("x[mm]", "T[degC]") + ROWS)
    for verb in ("diagnose", "fit"):
        assert main([verb, str(run), "--model", str(model), "--out", str(tmp_path / "o")]) == 2
        line = capsys.readouterr().err
        assert "--map x=COLUMN" in line
        assert "Recording" not in line
        assert "remove" not in line


def test_a_verdict_at_the_shell_names_options_in_text_file_and_page(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    t, rng = np.arange(500) / 100.0, np.random.default_rng(0)
    force = np.cumsum(rng.standard_normal(t.size))
    moved = simulate(load_model(str(model)), t, {"F": force}, hold="linear")["x"]
    columns = np.column_stack([t, force, moved + 1e-4 * rng.standard_normal(t.size)])
    run, out = tmp_path / "run.csv", tmp_path / "out"
    np.savetxt(run, columns, delimiter=",", header="t[s],F[N],x[m]", comments="")
    assert main(["diagnose", str(run), "--model", str(model), "--out", str(out), "--quiet"]) == 0
    told = capsys.readouterr().out
    files = [(out / n).read_text(encoding="utf-8") for n in ("verdict.json", "report.html")]
    for text in (told, *files):
        assert "noise={SENSOR" not in text
        assert "--noise SENSOR=VALUE" in text
    search, whole = re.findall(r"(?:^|in )([0-9.]+) s(?: in all.*)?$", told, re.MULTILINE)
    assert float(whole) >= float(search), "with reading and the page"
    assert "diagnosed in" in told
    assert main(["explain", str(out / "report.html")]) == 2
    assert f"that is the page; give its folder, {out}" in capsys.readouterr().err
    assert main(["explain", str(out / "absent")]) == 2
    assert "absent: no such file or folder; give what" in capsys.readouterr().err
