"""From the text a user types to a bond graph."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from actuators.models.catalogue import MODELS
from actuators.stack.plus_linear import PlusLinear
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.support.errors import BondsightError, UnusableInput, unknown_name

FURTHER_LAWS = (PlusLinear,)
"""Laws of `actuators` that a model file may hold."""


def load_model(text: str) -> BondGraph:
    """Model from a catalogue name, ``package.module:factory``, a ``.json`` or a ``.py`` file.

    A ``.py`` file is run and has to offer ``model()``; a ``.json`` file is only read.

    Raises
    ------
    UnusableInput
        One line: what cannot be loaded, where it failed, what to do.
    """
    if text in MODELS:
        factory: Callable[[], Any] = MODELS[text]
    elif text.endswith(".json"):
        return from_json(Path(text), laws=FURTHER_LAWS)
    elif text.endswith(".py"):
        factory = _from_file(Path(text))
    elif ":" in text:
        factory = _from_module(*text.split(":", 1))
    else:
        error = unknown_name("model", text, "the catalogue", MODELS)
        raise UnusableInput(
            f"{error}; or give package.module:factory, a .json file, or a .py file with model()"
        )
    graph = _call(factory, text)
    if not isinstance(graph, BondGraph):
        raise UnusableInput(
            f"model {text} returns {type(graph).__name__}, not a BondGraph; return the graph"
        )
    return graph


def model_name(text: str, graph: BondGraph) -> str:
    """Return what a model is called in reports: that of a file by its own name, not its path."""
    if not text.endswith((".json", ".py")):
        return text
    return graph.name or Path(text).stem


def _from_file(path: Path) -> Callable[[], Any]:
    if not path.is_file():
        raise UnusableInput(f"model file {path} does not exist; check the path")
    spec = importlib.util.spec_from_file_location(f"bondsight_model_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise UnusableInput(f"model file {path} cannot be read as Python")
    module = importlib.util.module_from_spec(spec)
    _run(lambda: spec.loader.exec_module(module), str(path))  # type: ignore[union-attr]
    return _factory(module, "model", str(path))


def _from_module(module: str, factory: str) -> Callable[[], Any]:
    sys.path.insert(0, str(Path.cwd()))
    try:
        found = _run(lambda: importlib.import_module(module), module)
    finally:
        sys.path.remove(str(Path.cwd()))
    return _factory(found, factory, module)


def _factory(module: ModuleType, name: str, where: str) -> Callable[[], Any]:
    factory = getattr(module, name, None)
    if not callable(factory):
        public = [
            n
            for n, v in vars(module).items()
            if not n.startswith("_") and callable(v) and v.__module__ == module.__name__
        ]
        raise UnusableInput(str(unknown_name("function", name, where, public)))
    return factory  # type: ignore[no-any-return]


def _call(factory: Callable[[], Any], where: str) -> Any:
    return _run(factory, where)


def _run(action: Callable[[], Any], where: str) -> Any:
    try:
        return action()
    except BondsightError:
        raise
    except (Exception, SystemExit) as error:
        frames = traceback.extract_tb(error.__traceback__)
        line = next((f for f in reversed(frames) if "identification" not in f.filename), frames[-1])
        if isinstance(error, SyntaxError) and error.lineno:
            place = f"line {error.lineno}"
        else:
            place = f"{Path(line.filename).name} line {line.lineno}"
        text = " ".join(str(error).split()) or "no message"
        raise UnusableInput(
            f"model {where} raised {type(error).__name__} at {place}: {text}; mend the model"
        ) from None
