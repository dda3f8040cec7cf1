"""Every block of the documentation runs, its commands exist, and it builds without a warning."""

from __future__ import annotations

import argparse
import io
import re
import runpy
import sys
import warnings
from contextlib import redirect_stderr
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from bondsight.cli.main import _parser
from identification.diagnosis import diagnose as whole
from identification.diagnosis.catalogue import CATALOGUE, by_name
from identification.diagnosis.search.forward_selection import SelectionStage

ROOT = Path(__file__).resolve().parents[1]
REFERENCE = runpy.run_path(str(ROOT / "docs/public_names.py"))
PACKAGES, public_names = REFERENCE["PACKAGES"], REFERENCE["public_names"]
PAGES = sorted(p for p in (ROOT / "docs").rglob("*.md") if "_build" not in p.parts)
WRITTEN = [p for p in PAGES if "reference/effects" not in p.as_posix()]


def _blocks(page: Path) -> list[str]:
    text = page.read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)


# the blocks that examples of docstrings begin with run in test_docstrings.py
RUN = [p for p in WRITTEN if _blocks(p) and p.stem != "examples"]


def _slow(page: Path) -> Any:
    # what the first lesson diagnoses is what the README does, test_readme.py
    marks = [pytest.mark.long] if page.stem == "first_diagnosis" else []
    return pytest.param(page, marks=marks, id=page.stem)


@pytest.mark.parametrize("page", [_slow(page) for page in RUN])
def test_the_blocks_of_a_page_run(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    module = ModuleType(f"page_{page.stem}")
    monkeypatch.setitem(sys.modules, module.__name__, module)  # classes look for their module
    for i, block in enumerate(_blocks(page), start=1):
        exec(compile(block, f"{page.name}, block {i}", "exec"), vars(module))


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_has_an_example(package: str) -> None:
    shown = {n: v for n, v in public_names(package) if callable(v)}
    assert [n for n, v in shown.items() if ">>> " not in (v.__doc__ or "")] == []


def test_the_picture_of_a_current_limit_shows_both_limits() -> None:
    pages = runpy.run_path(str(ROOT / "docs/catalogue_pages.py"))
    (line,) = pages["picture"](by_name("current_limit")).axes[0].lines
    assert line.get_ydata().min() < 0 < line.get_ydata().max()


def test_authors_that_effects_name_with_a_year_stand_in_the_bibliography() -> None:
    page = (ROOT / "docs/reference/bibliography.md").read_text(encoding="utf-8")
    named = {e.source.split()[0].rstrip(",") for e in CATALOGUE if re.search(r"19|20", e.source)}
    known = {n for n in named if n[0].isupper()} - {"Coulomb", "Duffing", "Torricelli"}
    assert len(known) > 8
    assert {n for n in known if n.split("-")[0] not in page} == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_every_link_has_a_text(page: Path) -> None:
    assert re.findall(r"\[\]\([^)]*\)", page.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(("name", "extra"), [("to_pandas()", "tables"), ("an FMU", "fmi")])
def test_the_first_lesson_says_what_is_to_be_installed(name: str, extra: str) -> None:
    page = (ROOT / "docs/tutorials/first_diagnosis.md").read_text(encoding="utf-8")
    assert name in page
    assert f"pip install 'bondsight[{extra}]'" in page


def test_the_first_block_of_the_first_lesson_is_a_model_file() -> None:
    names: dict[str, Any] = {}
    exec(_blocks(ROOT / "docs/tutorials/first_diagnosis.md")[0], names)
    assert names["model"]().name == "positioner"


def test_the_first_lesson_diagnoses_the_file_that_it_wrote(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of its blocks run, with the model as it is in place of what the search finds."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        whole, "steps", lambda base, *_: SelectionStage((), base, None, (), (), True)
    )
    names: dict[str, Any] = {}
    *before, last = _blocks(ROOT / "docs/tutorials/first_diagnosis.md")
    for block in (*before, re.sub(r"^\(step,\) = .*\n^assert .*\n", "", last, flags=re.M)):
        exec(block, names)
    assert names["found"].recording.units == {"F": "N", "x": "m"}
    assert {p.name for p in tmp_path.glob("**/*.*")} >= {"report.html", "before_and_after.png"}


def test_the_commands_of_the_pages_exist() -> None:
    used = {
        verb
        for page in WRITTEN
        for verb in re.findall(r"^ {4,}bondsight ([a-z]+)", page.read_text(encoding="utf-8"), re.M)
    }
    assert len(used) > 8
    (verbs,) = (a for a in _parser()._actions if isinstance(a, argparse._SubParsersAction))
    assert used <= set(verbs.choices)


def _built(builder: str, folder: Path) -> Path:
    """Build in this process, where most of what is documented has been imported already."""
    pytest.importorskip("sphinx", reason="the extra 'docs' is not installed")
    from sphinx.cmd.build import build_main

    said = io.StringIO()
    with warnings.catch_warnings(), redirect_stderr(said):
        warnings.simplefilter("ignore")  # those of others
        code = build_main(
            ["-q", "-W", "--keep-going", "-b", builder, str(ROOT / "docs"), str(folder / builder)]
        )
    assert code == 0, said.getvalue()[-3000:]
    return folder / builder


@pytest.mark.slow
def test_the_pages_are_read_and_linked_without_a_warning(tmp_path: Path) -> None:
    trees = _built("dummy", tmp_path) / ".doctrees/reference"
    assert (trees / "effects/backlash.doctree").is_file()
    assert b"bondsight.diagnose" in (trees / "api/bondsight.doctree").read_bytes()


@pytest.mark.long
def test_the_pages_build_without_a_warning(tmp_path: Path) -> None:
    pages = _built("html", tmp_path) / "reference"
    assert (pages / "effects/backlash.html").is_file()
    assert "bondsight.diagnose" in (pages / "api/bondsight.html").read_text(encoding="utf-8")
