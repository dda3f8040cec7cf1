"""The Python of the README runs as it stands, block after block."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any

import pytest

import bondgraph
import bondsight

README = Path(__file__).resolve().parents[1] / "README.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```", README.read_text(encoding="utf-8"), re.M | re.S)


def test_the_python_blocks_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "readme"}
    for i, block in enumerate(BLOCKS, start=1):
        exec(compile(block, f"README.md, block {i}", "exec"), names)
    (step,) = names["found"].findings
    assert (step.answer, step.chosen.label) == ("exact", "coulomb_friction at d")
    assert (tmp_path / "out/report.html").is_file()


def test_it_fits_on_a_screen_and_a_half() -> None:
    assert len(README.read_text(encoding="utf-8").splitlines()) < 150


def test_its_links_lead_somewhere() -> None:
    linked = re.findall(r"\]\(([^)#]+)\)", README.read_text(encoding="utf-8"))
    assert linked
    assert [n for n in linked if not (README.parent / n).exists()] == []


def test_the_commands_of_the_readme_exist() -> None:
    from bondsight.cli.main import _parser

    text = README.read_text(encoding="utf-8")
    used = set(re.findall(r"^    bondsight ([a-z]+)", text, re.M))
    assert used, "no command found"
    assert used <= set(_verbs(_parser()))


def _verbs(parser: argparse.ArgumentParser) -> list[str]:
    (verbs,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    return list(verbs.choices)


def test_every_name_that_the_example_speaks_of_comes_from_where_it_says() -> None:
    """A reader wondered where `Da` comes from."""
    text = README.read_text(encoding="utf-8")
    (told,) = re.findall(r"the real one rubs\.(.*?):\n\n```python", text, re.S)
    front, _, behind = told.partition("come from `bondsight`")
    inside, outside = (set(re.findall(r"`([A-Z][A-Za-z]*)`", part)) for part in (front, behind))
    assert {"De", "Df", "Dq", "One", "Se"} <= inside <= {*dir(bondsight)}
    assert outside == {"Da"} <= {*dir(bondgraph)} - {*dir(bondsight)}
