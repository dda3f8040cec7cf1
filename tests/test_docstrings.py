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
def begun(blocks: tuple[int, ...]) -> dict[str, Any]:
    """Return what the examples of the reference begin with: some blocks of their page."""
    page = (ROOT / "docs/reference/examples.md").read_text(encoding="utf-8")
    found = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)
    names: dict[str, Any] = {}
    for number in blocks:
        exec(found[number], names)
    return names


def blocks_for(text: str) -> tuple[int, ...]:
    """Return which blocks the examples of a module need; a diagnosis takes its time."""
    lines = "\n".join(re.findall(r"(?:>>>|\.\.\.) .*", text))
    words = (r"\b(?:fit|study)\b", r"\(found[,)]|found\.findings", "virtual_bench|STATION")
    return (0, *(i for i, w in enumerate(words, 1) if re.search(w, lines)))


@pytest.mark.parametrize("module", MODULES)
def test_examples_run(module: str) -> None:
    made = import_module(module)
    blocks = blocks_for(Path(str(made.__file__)).read_text(encoding="utf-8"))
    if 3 in blocks and shutil.which("gcc") is None:
        pytest.skip("the stub of the interferometer's library is C code")
    more = {n: v for n, v in begun(blocks).items() if n not in vars(made)}
    result = doctest.testmod(made, extraglobs=more, optionflags=doctest.ELLIPSIS)
    assert (result.failed, result.attempted > 0) == (0, True)
