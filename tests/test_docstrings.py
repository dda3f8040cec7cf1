"""Every example in a docstring of the packages is run."""

from __future__ import annotations

import doctest
import re
import shutil
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bondsight", "bondgraph", "actuators", "identification", "hardware")
MODULES = sorted(
    ".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for package in PACKAGES
    for p in (ROOT / package).rglob("*.py")
    if ">>> " in p.read_text(encoding="utf-8")
)


def test_there_are_examples() -> None:
    assert len(MODULES) > 150


@cache
def begun(blocks: int) -> dict[str, Any]:
    """Return what the examples of the reference begin with: the first blocks of their page."""
    page = (ROOT / "docs/reference/examples.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    for block in re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)[:blocks]:
        exec(block, names)
    return names


def blocks_for(text: str) -> int:
    """Return how many blocks the examples of a module need; a diagnosis takes its time."""
    lines = "\n".join(re.findall(r"(?:>>>|\.\.\.) .*", text))
    last = ("virtual_bench|STATION", r"\(found[,)]|found\.findings", r"\b(?:fit|study)\b")
    return next((4 - i for i, words in enumerate(last) if re.search(words, lines)), 1)


@pytest.mark.parametrize("module", MODULES)
def test_examples_run(module: str) -> None:
    made = import_module(module)
    count = blocks_for(Path(str(made.__file__)).read_text(encoding="utf-8"))
    if count == 4 and shutil.which("gcc") is None:
        pytest.skip("the stub of the interferometer's library is C code")
    more = {n: v for n, v in begun(count).items() if n not in vars(made)}
    result = doctest.testmod(made, extraglobs=more, optionflags=doctest.ELLIPSIS)
    assert (result.failed, result.attempted > 0) == (0, True)
