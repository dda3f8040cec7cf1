"""Pages of the reference: one for each package, its public names from their docstrings."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

PACKAGES = {
    "bondsight": "what most scripts need, under one name",
    "bondgraph": "the language, equations and simulation",
    "bondgraph.laws": "constitutive laws",
    "bondgraph.hysteresis": "operators with memory",
    "actuators": "machines as graphs and data",
    "identification": "fits, uncertainty, experiments, diagnosis",
    "hardware": "benches",
}


def public_names(package: str) -> Iterator[tuple[str, Any]]:
    """Every name that a package shows, with what it stands for."""
    module = import_module(package)
    shown = getattr(module, "__all__", None) or [
        n for n, v in vars(module).items()
        if not n.startswith("_") and getattr(v, "__module__", "").startswith(f"{package}.")
    ]  # fmt: skip
    for name in sorted(shown, key=str.lower):
        yield name, getattr(module, name)


def write_reference(folder: Path) -> None:
    """Write a page for each package, and their list; a name stands on the first page it is on."""
    folder.mkdir(parents=True, exist_ok=True)
    seen: dict[int, str] = {}
    for package, says in PACKAGES.items():
        own = [(n, v) for n, v in public_names(package) if id(v) not in seen]
        elsewhere = [(n, seen[id(v)]) for n, v in public_names(package) if id(v) in seen]
        seen |= {id(v): package for _, v in own}
        lines = [package, "=" * len(package), "", says[0].upper() + says[1:] + ".", ""]
        lines += ["Examples begin with :doc:`this model and these recordings <../examples>`.", ""]
        if elsewhere:
            names = ", ".join(f":py:obj:`{n} <{home}.{n}>`" for n, home in elsewhere)
            lines += [f"Described with the packages that show them too: {names}.", ""]
        for name, value in own:
            lines += _entry(f"{package}.{name}", value)
        (folder / f"{package}.rst").write_text("\n".join(lines), encoding="utf-8")
    index = ["Public names", "============", "", ".. toctree::", "   :maxdepth: 1", ""]
    index += [f"   {package}" for package in PACKAGES]
    (folder / "index.rst").write_text("\n".join(index) + "\n", encoding="utf-8")


def _entry(name: str, value: Any) -> list[str]:
    if inspect.isclass(value):
        return [f".. autoclass:: {name}", ""]
    if callable(value):
        return [f".. autofunction:: {name}", ""]
    return [f".. py:data:: {name}", ""]
