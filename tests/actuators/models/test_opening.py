"""A model that cannot be loaded says where it failed, in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from actuators.models.opening import load_model
from bondgraph.support.errors import UnusableInput


def refused(text: str) -> str:
    with pytest.raises(UnusableInput) as found:
        load_model(text)
    assert "\n" not in str(found.value)
    return str(found.value)


def written(folder: Path, text: str, name: str = "mine.py") -> str:
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


@pytest.mark.parametrize("folder", ["plain", "identification", "actuators"])
def test_the_place_is_that_of_the_model_wherever_it_lies(tmp_path: Path, folder: str) -> None:
    text = "def model():\n    return 1 / 0\n"
    assert "ZeroDivisionError at mine.py line 2: " in refused(written(tmp_path / folder, text))
    assert "SyntaxError at line 1: " in refused(written(tmp_path / folder, "def model(:\n"))
    missing = refused(written(tmp_path / folder, "\nimport no_such_package\n"))
    assert "ModuleNotFoundError at mine.py line 2: " in missing


def test_a_factory_that_needs_an_argument_has_no_wrong_place(tmp_path: Path) -> None:
    file = written(tmp_path, "def model(k):\n    return k\n")
    said = refused(file)
    assert said.startswith(f"model {file} raised TypeError: model() missing 1 required")
    assert "opening.py" not in said


@pytest.mark.parametrize("words", ["-784.8, unit='N'", "value=-784.8"])
@pytest.mark.parametrize(("kind", "said"), [("Se", "effort is MSe"), ("Sf", "flow is MSf")])
def test_a_constant_source_is_proposed(tmp_path: Path, kind: str, words: str, said: str) -> None:
    text = f"from bondsight import {kind}\ndef model():\n    return {kind}('weight', {words})\n"
    line = refused(written(tmp_path, text))
    assert "TypeError at mine.py line 3: " in line
    assert line.endswith(f"a constant {said}(name, value, unit=...)")


def test_what_is_no_model_file_is_said(tmp_path: Path) -> None:
    for text in (str(tmp_path), written(tmp_path, "m = 1", "model.txt"), "."):
        assert refused(text).startswith(f"model {text} is neither a .py nor a .json file")


def test_a_module_that_does_not_exist_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert refused("no_such.part:thing") == "no module 'no_such'; check the name"
    assert refused("json.part:thing") == "no module 'json.part'; check the name"
    monkeypatch.chdir(tmp_path)
    written(tmp_path, "import no_such_package\n", "lacks_another.py")
    said = refused("lacks_another:thing")
    assert "lacks_another raised ModuleNotFoundError at lacks_another.py line 1: " in said
