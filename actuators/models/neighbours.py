"""Modules that lie beside a model file: to be imported while it is loaded, and no longer."""

from __future__ import annotations

import ast
import importlib
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from bondgraph.support.errors import UnusableInput

OURS = frozenset({"actuators", "bondgraph", "bondsight", "hardware", "identification"})
"""Never taken from a folder: a model may lie in a checkout."""


@contextmanager
def neighbours(file: Path) -> Iterator[None]:
    """Let a model file import what lies in its folder; afterwards nothing of it is left.

    What is installed goes before. Modules of the folder leave ``sys.modules`` in the end: those of
    another model may have their names, and worker processes are sent what has no module to import.

    Raises
    ------
    UnusableInput
        A module that the file or its neighbours import is there and installed too.
    """
    folder = file.resolve().parent
    importlib.invalidate_caches()
    _require_one_meaning(file.resolve(), folder)
    finder = _Beside(folder)
    sys.meta_path.append(finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        for name in [n for n in sys.modules if n.partition(".")[0] in finder.found]:
            del sys.modules[name]


@contextmanager
def registered(module: ModuleType) -> Iterator[None]:
    """Have a module in ``sys.modules`` meanwhile, where dataclasses look up their annotations."""
    before = sys.modules.get(module.__name__)
    sys.modules[module.__name__] = module
    try:
        yield
    finally:
        if before is None:
            sys.modules.pop(module.__name__, None)
        else:
            sys.modules[module.__name__] = before


class _Beside(MetaPathFinder):
    """Finds modules of one folder; remembers which."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.found = folder, set[str]()

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the module of this name, unless it is a part of a package."""
        spec = None if path is not None else _in_folder(name, self.folder)
        if spec is not None:
            self.found.add(name)
        return spec


def _in_folder(name: str, folder: Path) -> ModuleSpec | None:
    return PathFinder.find_spec(name, [str(folder)])


def _require_one_meaning(file: Path, folder: Path) -> None:
    """Refuse names that mean a module of the folder as well as an installed one."""
    todo, seen = [file], {file}
    while todo:
        here = todo.pop()
        for name in sorted(_imported(here) - OURS):
            spec = _in_folder(name, folder)
            if spec is None or spec.origin is None:
                continue  # not there, or a folder without modules
            other = _elsewhere(name)
            if other and not _same(other, spec.origin):
                raise UnusableInput(
                    f"model {file}: {here.name} imports {name}, which is {Path(spec.origin).name} "
                    f"beside it and an installed module ({other}); rename the one beside it"
                )
            if (beside := Path(spec.origin)) not in seen:
                seen.add(beside)
                todo.append(beside)


def _imported(file: Path) -> set[str]:
    """Return the first names of what a file imports; what cannot be read is said when it is run."""
    names: set[str] = set()
    with suppress(OSError, SyntaxError, ValueError):
        for node in ast.walk(ast.parse(file.read_bytes())):
            if isinstance(node, ast.Import):
                names |= {a.name.partition(".")[0] for a in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names.add(node.module.partition(".")[0])
    return names


def _elsewhere(name: str) -> str:
    """Return where a module of this name is found without the folder; empty if nowhere."""
    try:
        spec = find_spec(name)
    except (ImportError, ValueError):  # one that was put together at run time
        return getattr(sys.modules.get(name), "__file__", None) or name
    return "" if spec is None else spec.origin or name


def _same(one: str, other: str) -> bool:
    return os.path.realpath(one) == os.path.realpath(other)
