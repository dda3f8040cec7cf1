"""Public names of a package, loaded when first asked for; a stub beside ``__init__`` lists them."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def stub_names(stub: str) -> dict[str, tuple[str, str]]:
    """Return the names that a stub imports: name -> (module, name there).

    Parameters
    ----------
    stub : str
        Text of an ``__init__.pyi`` whose statements are ``from module import name as name``.
    """
    return {
        alias.asname or alias.name: (node.module, alias.name)
        for node in ast.parse(stub).body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


def attach(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package with a stub.

    Type checkers and editors read the stub; a program pays only for the names it uses (PEP 562).
    """
    module = sys.modules[package]
    assert module.__file__ is not None
    places = stub_names(Path(module.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))

    def getattr_(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name)
        home, there = places[name]
        value = getattr(import_module(home), there)
        setattr(module, name, value)
        return value

    def dir_() -> list[str]:
        return sorted({*vars(module), *places})

    return getattr_, dir_, sorted(places)
