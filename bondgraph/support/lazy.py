"""Public names of a package, loaded when first asked for; a stub beside ``__init__`` lists them."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.resources import files
from types import ModuleType
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
    stub = files(package).joinpath("__init__.pyi")
    places = stub_names(stub.read_text(encoding="utf-8"))

    def getattr_(name: str) -> Any:
        if name not in places:
            from bondgraph.support.errors import nearest

            close = () if name.startswith("_") else nearest(name, places, 1)
            meant = f". Did you mean {close[0]!r}?" if close else ""
            raise AttributeError(f"module {package!r} has no attribute {name!r}{meant}", name=name)
        home, there = places[name]
        value = getattr(_loaded(home), there)
        setattr(module, name, value)
        return value

    def dir_() -> list[str]:
        dunders = {n for n in vars(module) if n.startswith("__")}
        return sorted({*dunders, *places})

    return getattr_, dir_, sorted(places)


def _loaded(home: str) -> ModuleType:
    """Import a module; once more where a library met another thread's import while it looked.

    Some libraries walk through ``sys.modules`` when they are imported, and fail if it grows then.
    """
    for left in reversed(range(TRIES)):
        try:
            # parents first: a thread that holds a leaf and waits for its parent may meet another
            for end, sign in enumerate(home):
                if sign == ".":
                    import_module(home[:end])
            return import_module(home)
        except RuntimeError as error:
            if not left or "changed size during iteration" not in str(error):
                raise
    raise AssertionError(home)


TRIES = 5
