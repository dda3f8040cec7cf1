"""The help on one screen, every option with its word, models by name, completion of words."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bondsight
from actuators.models import opening
from actuators.models.catalogue import MODELS
from bondgraph.signals.files import any_file
from bondsight.cli.main import _parser, main
from identification.diagnosis import diagnose as whole
from identification.diagnosis.search.forward_selection import SelectionStage
from tests.bondsight.carriage_files import GOOD

ROOT = Path(bondsight.__file__).resolve().parents[1]
ELSEWHERE = {"compensate", "blind", "conformance", "coverage", "published", "real"}


def verbs() -> dict[str, argparse.ArgumentParser]:
    (found,) = (a for a in _parser()._actions if isinstance(a, argparse._SubParsersAction))
    return dict(found.choices)


def test_every_verb_stands_once_on_one_screen() -> None:
    lines = _parser().format_help().splitlines()
    assert len(lines) <= 50
    assert max(map(len, lines)) <= 100
    listed = [line.split()[0] for line in lines if line.startswith("  ")]
    for verb in verbs():
        assert listed.count(verb) == 1


def unexplained() -> Iterator[str]:
    for verb, parser in verbs().items():
        for a in parser._actions:
            if verb not in ELSEWHERE and not a.help:
                yield f"{verb} {a.dest}"


def test_every_option_says_what_it_is() -> None:
    assert list(unexplained()) == []
    assert all(p.description for p in verbs().values())


@pytest.mark.parametrize("verb", ["acquire", "diagnose", "fit", "studio"])
def test_the_options_of_a_long_verb_stand_in_groups(verb: str) -> None:
    """A new user met thirty of them in one list."""
    _, loose, *groups = verbs()[verb]._action_groups
    assert [a.dest for a in loose._group_actions] == ["help"]
    assert groups[-1].title == "what is written and shown"
    assert all(2 < len(g._group_actions) < 18 for g in groups)


def test_help_names_every_kind_of_file_that_is_read() -> None:
    said = verbs()["diagnose"].format_help()
    assert [kinds for kinds in any_file._READERS if not any(k in said for k in kinds)] == []


def test_the_version_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"bondsight {bondsight.__version__}\n"


def test_models_are_listed_and_described(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(MODELS)
    assert all(len(line.split()) > 2 for line in lines)
    assert main(["models", "thermal_lag"]) == 0
    text = capsys.readouterr().out
    for word in ("inputs: u [", "readings: y [", "parameters:", "elements: "):
        assert word in text
    assert main(["models", "thermal_lack"]) == 2
    assert "Did you mean 'thermal_lag'" in capsys.readouterr().err


@pytest.mark.skipif(find_spec("argcomplete") is None, reason="needs argcomplete")
def test_a_shell_completes_words(tmp_path: Path) -> None:
    line, answer = "bondsight diagnose --mo", tmp_path / "words"
    asked = {
        "_ARGCOMPLETE": "1", "_ARGCOMPLETE_STDOUT_FILENAME": str(answer), "COMP_LINE": line,
        "COMP_POINT": str(len(line)), "_ARGCOMPLETE_IFS": "\n",
    }  # fmt: skip
    path = os.pathsep.join([str(ROOT), *sys.path])
    env = os.environ | asked | {"PYTHONPATH": path}
    subprocess.run([sys.executable, "-m", "bondsight"], env=env,
                   check=True, cwd=tmp_path)  # fmt: skip
    assert answer.read_text().split() == ["--model"]


@pytest.fixture
def carriage(tmp_path: Path) -> list[str]:
    """Words of a diagnosis."""
    (tmp_path / "carriage.py").write_text(GOOD)
    rows = [f"{0.01 * i:.2f},{np.sin(0.3 * i):.6f},{np.cos(0.3 * i):.6f}" for i in range(60)]
    (tmp_path / "run.csv").write_text("\n".join(["t_s,F[N],x[mm]", *rows]))
    words = ["run.csv", "--model", "carriage.py", "--out", "out"]
    return ["diagnose", *(str(tmp_path / w) if w[0] != "-" else w for w in words), "--quiet"]


def test_ctrl_c_while_files_are_read_says_the_same(
    carriage: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(opening, "load_model", stopped)
    assert main(carriage) == 130
    line = "bondsight: stopped before anything was found, so nothing was written\n"
    assert capsys.readouterr().err == line


@pytest.mark.parametrize("seconds", [None, "1e-9"])
def test_one_sentence_says_that_nothing_was_written(
    seconds: str | None, carriage: list[str], capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    def stopped(*_: object, progress: Any, **__: object) -> None:
        progress("searching", 0.5)
        raise KeyboardInterrupt

    monkeypatch.setattr(whole, "diagnose", stopped)
    assert main([*carriage, *(["--time", seconds] if seconds else [])]) == 130
    when = "the time was over" if seconds else "stopped"
    line = f"bondsight: {when} before anything was found, so nothing was written\n"
    assert capsys.readouterr().err == line


@pytest.mark.parametrize(
    ("more", "code"), [([], 130), pytest.param(["--time", "1000"], 0, marks=pytest.mark.long)]
)
def test_what_is_stopped_in_its_first_step_is_written(
    more: list[str], code: int, carriage: list[str], tmp_path: Path,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    rows = [f"{0.01 * i:.2f},{np.sin(0.3 * i):.6f},{np.cos(0.3 * i):.6f}" for i in range(300)]
    (tmp_path / "run.csv").write_text("\n".join(["t_s,F[N],x[mm]", *rows]))

    def stopped(base: Any, *_: object) -> SelectionStage:
        return SelectionStage((), base, None, (), (), True)

    for looked in ("told_by_values", "mixups"):  # what comes before the step takes its time
        monkeypatch.setattr(whole, looked, lambda *_, **__: ())
    monkeypatch.setattr(whole, "steps", stopped)
    assert main([*carriage, *more]) == code
    assert {f.name for f in (tmp_path / "out").iterdir()} == {"report.html", "verdict.json"}
    said = capsys.readouterr()
    assert (said.out + said.err).count(whole.STOPPED_AT_ONCE) == 1  # it was told twice
    assert main([*carriage, *more, "--json"]) == code
    assert f"bondsight: {whole.STOPPED_AT_ONCE}" in capsys.readouterr().err


def test_no_folder_is_left_that_nothing_was_written_to(
    carriage: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: object, **__: object) -> None:
        assert (tmp_path / "new" / "out").is_dir()
        raise KeyboardInterrupt

    monkeypatch.setattr(whole, "diagnose", stopped)
    assert main([*carriage, "--out", str(tmp_path / "new" / "out")]) == 130
    assert not (tmp_path / "new").exists()
    (tmp_path / "new" / "out").mkdir(parents=True)  # the user's own stays
    assert main([*carriage, "--out", str(tmp_path / "new" / "out")]) == 130
    assert (tmp_path / "new" / "out").is_dir()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["diagnose", "run.csv", "--modle", "m.py"], "no option --modle (did you mean --model?)"),
        (["diagnose", "r.csv", "--model", "m", "--ouut=x"], "no option --ouut (did you mean --out"),
        (["--versoin"], "no option --versoin (did you mean --version?)"),
        (["effects", "--zzzz"], "unrecognized arguments: --zzzz"),
    ],
)
def test_a_misspelled_option_names_the_one_meant(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(words)
    assert capsys.readouterr().err.startswith(f"bondsight: {said}")


def test_a_diagnosis_is_told_what_is_known(
    carriage: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[Any] = []

    def stopped(*given: Any, **__: object) -> None:
        asked.append(given)
        raise KeyboardInterrupt

    monkeypatch.setattr(whole, "diagnose", stopped)
    words = "--no-lags --no-offsets --start d=3 --fix m=0.6 --gain x=2% --rest"
    assert main([*carriage, *words.split()]) == 130
    ((study,),) = asked
    assert [(v.name, v.start) for v in study.free] == [("d", 3.0), ("k", None)]
    assert study.fixed == {"m": 0.6}
    assert (study.nuisances.offsets, study.nuisances.lags, study.initial) == (False, False, "rest")
    assert study.nuisances.gains["x"].within == 0.02
    for words, said in (
        ("--start dd=3", "no parameter of --start 'dd'"),
        ("--fix m=0.5 --fix m=0.6", "--fix m=0.6: m was given before; give it once"),
        ("--fix m=0.5 --start m=0.6", "--start m: m is held by --fix"),
    ):
        assert main([*carriage, *words.split()]) == 2
        assert said in capsys.readouterr().err
    asked.clear()
    assert main(carriage) == 130
    ((graph, _, _),) = asked
    assert graph.name == "carriage"
