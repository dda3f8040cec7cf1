"""Public class names are unique in the distribution: one concept, one name."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter, defaultdict
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bondsight", "bondgraph", "actuators", "identification", "hardware")


def public_classes(text: str) -> list[str]:
    """Return the public classes that a module defines at its top."""
    return [
        n.name
        for n in ast.parse(text).body
        if isinstance(n, ast.ClassDef) and not n.name.startswith("_")
    ]


def shared_names(texts: dict[str, str]) -> dict[str, list[str]]:
    """Return the class names that several modules define, with the modules.

    Only modules with a line that looks as if it named a class of another one are parsed.
    """
    looks = {s: set(re.findall(r"^class (\w+)", text, re.M)) for s, text in texts.items()}
    often = Counter(name for names in looks.values() for name in names)
    found: dict[str, list[str]] = defaultdict(list)
    for source, text in texts.items():
        if all(often[name] == 1 for name in looks[source]):
            continue
        for name in public_classes(text):
            found[name].append(source)
    return {name: sources for name, sources in found.items() if len(sources) > 1}


def test_a_class_name_means_one_thing() -> None:
    texts = {
        p.relative_to(ROOT).as_posix(): p.read_text(encoding="utf-8")
        for package in PACKAGES
        for p in (ROOT / package).rglob("*.py")
    }
    assert len(texts) > 500
    assert shared_names(texts) == {}


def test_shared_names_are_seen() -> None:
    texts = {"a.py": "class A: ...\nclass _B: ...", "b.py": "class A: ...\nclass _B: ..."}
    assert shared_names(texts) == {"A": ["a.py", "b.py"]}


def test_no_loose_modules() -> None:
    for package in ("bondgraph", "identification"):
        assert [p.name for p in (ROOT / package).glob("*.py")] == ["__init__.py"]
    diagnosis = {p.name for p in (ROOT / "identification" / "diagnosis").glob("*.py")}
    assert diagnosis == {"__init__.py", "diagnose.py"}


DOORS = ("bondsight", "bondgraph", "bondgraph.laws", "actuators", "identification", "hardware")


@pytest.mark.parametrize("door", DOORS)
def test_every_public_name_opens(door: str) -> None:
    module = import_module(door)
    names: list[str] = vars(module)["__all__"]
    assert len(names) > 10
    assert set(names) <= set(dir(module))
    assert all(getattr(module, name) is not None for name in names)
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = module.no_such_name


def test_the_front_door_is_small_and_light() -> None:
    import bondsight

    names = dict(vars(bondsight))["__all__"]
    assert len(names) <= 40
    assert {"Study", "Vary", "Nuisances", "Known"} <= set(names)  # what a study is stated with
    heavy = ("numpy", "scipy", "sympy", "casadi", "matplotlib", "networkx")
    said = subprocess.run(
        [
            sys.executable,
            "-c",
            f"import sys, bondsight; print([m for m in {heavy!r} if m in sys.modules])",
        ],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert said.stdout.strip() == "[]"
