"""The Python of the README runs as it stands, block after block."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any

import pytest

README = Path(__file__).resolve().parents[1] / "README.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```", README.read_text(encoding="utf-8"), re.M | re.S)


def test_the_python_blocks_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "readme"}
    for i, block in enumerate(BLOCKS, start=1):
        exec(compile(block, f"README.md, block {i}", "exec"), names)
    # the lesson needs a misfit that no parameter removes
    assert names["result"].chi2("test") > 10.0


def test_the_first_block_alone_is_a_model_file() -> None:
    names: dict[str, Any] = {}
    exec(BLOCKS[0], names)
    assert names["model"]().name == "positioner"


def test_the_table_of_effects_is_the_catalogue() -> None:
    from identification.diagnosis.catalogue.words import catalogue_table

    text = README.read_text(encoding="utf-8")
    found = re.findall(r"<!-- effects -->\n(.*?)\n<!-- /effects -->", text, re.S)
    # when it fails: put the output of `bondsight effects` there
    assert found == [catalogue_table()]


def test_the_commands_of_the_readme_exist() -> None:
    from bondsight.cli.main import _parser

    text = README.read_text(encoding="utf-8")
    used = set(re.findall(r"^    bondsight ([a-z]+)", text, re.M))
    assert used, "no command found"
    assert used <= set(_verbs(_parser()))


def _verbs(parser: argparse.ArgumentParser) -> list[str]:
    (verbs,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    return list(verbs.choices)
