"""From the text a user types to a bond graph."""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from actuators.models.catalogue import LOADED, MODELS
from actuators.models.neighbours import neighbours, registered
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.support.errors import BondsightError, UnusableInput, unknown_name

_HOME = Path(__file__).parents[2]
_NOT_THE_MODEL = (
    *(_HOME / k for k in ("actuators", "bondgraph", "bondsight", "hardware", "identification")),
    Path(importlib.__file__).parent,
)
_IN_FILE = re.compile(r"(?P<path>.*\.py)(:(?P<factory>[^:/\\]*))?")


def load_model(text: str, *, loaded: bool = False) -> BondGraph:
    """Model from a catalogue name, ``package.module:factory``, a ``.json`` or a ``.py`` file.

    A ``.py`` file is run and has to offer ``model()``, or the function or graph that is named
    behind it (``FILE.py:NAME``); it may import what lies beside it. A ``.json`` file is only
    read. With `loaded` an actuator of the catalogue has the external force among its inputs.

    Raises
    ------
    UnusableInput
        One line: what cannot be loaded, where it failed, what to do.
    """
    if text in MODELS:
        graph = _call((LOADED if loaded else {}).get(text, MODELS[text]), text)
    elif text.endswith(".json"):
        return from_json(Path(text))
    elif in_file := _IN_FILE.fullmatch(text):
        graph = _from_file(Path(in_file["path"]), in_file["factory"] or "model")
    elif ":" in text:
        graph = _call(_from_module(*text.split(":", 1)), text)
    elif os.path.exists(text):  # unlike Path.exists it takes any text
        raise UnusableInput(
            f"model {text} is neither a .py nor a .json file, nor a model of the catalogue; give "
            "a .py file with model(), or a name of bondsight models"
        )
    else:
        beside = next((text + end for end in (".py", ".json") if os.path.exists(text + end)), "")
        if beside:
            raise UnusableInput(
                f"no model {text!r} in the catalogue, but there is a file {beside}: give that"
            )
        error = unknown_name("model", text, "the catalogue", MODELS)
        raise UnusableInput(
            f"{error}; bondsight models lists them; or give package.module:factory, a .json "
            "file, or a .py file with model()"
        )
    if not isinstance(graph, BondGraph):
        raise UnusableInput(
            f"model {text} returns {type(graph).__name__}, not a BondGraph; return the graph"
        )
    return graph


def model_name(text: str, graph: BondGraph) -> str:
    """Return what a model is called in reports: that of a file by its own name, not its path."""
    in_file = _IN_FILE.fullmatch(text)
    if in_file is None and not text.endswith(".json"):
        return text
    return graph.name or Path(in_file["path"] if in_file else text).stem


def _from_file(path: Path, factory: str) -> Any:
    """Run a file and a function of it; both may import what lies beside it."""
    if not path.is_file():
        raise UnusableInput(f"model file {path} does not exist; check the path")
    spec = importlib.util.spec_from_file_location(f"bondsight_model_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise UnusableInput(f"model file {path} cannot be read as Python")
    module = importlib.util.module_from_spec(spec)
    with neighbours(path), registered(module):
        _run(lambda: spec.loader.exec_module(module), str(path))  # type: ignore[union-attr]
        return _call(_factory(module, factory, str(path)), str(path))


def _from_module(module: str, factory: str) -> Callable[[], Any]:
    sys.path.insert(0, str(Path.cwd()))
    try:
        found = _run(lambda: _imported(module), module)
    finally:
        sys.path.remove(str(Path.cwd()))
    return _factory(found, factory, module)


def _imported(module: str) -> ModuleType:
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise  # the module is there and lacks another one
        raise UnusableInput(f"no module {error.name!r}; check the name") from None


def _factory(module: ModuleType, name: str, where: str) -> Callable[[], Any]:
    factory = getattr(module, name, None)
    if isinstance(factory, BondGraph):
        return lambda: factory
    if not callable(factory):
        public = [n for n, v in vars(module).items() if not n.startswith("_") and _own(v, module)]
        raise UnusableInput(str(unknown_name("function", name, where, public)))
    return factory  # type: ignore[no-any-return]


def _own(value: Any, module: ModuleType) -> bool:
    here = callable(value) and value.__module__ == module.__name__
    return here or isinstance(value, BondGraph)


def _call(factory: Callable[[], Any], where: str) -> Any:
    return _run(factory, where)


def _run(action: Callable[[], Any], where: str) -> Any:
    try:
        return action()
    except BondsightError as error:
        if (place := _place(error)) and not getattr(error, "__notes__", ()):
            error.add_note(place.strip())
        if _constant_source(error):
            raise _raised(error, where) from None
        raise
    except (Exception, SystemExit) as error:
        raise _raised(error, where) from None


def _raised(error: BaseException, where: str) -> UnusableInput:
    """Return the line on what a model raised; a `TypeError` of ours is told as one."""
    kind = "TypeError" if isinstance(error, TypeError) else type(error).__name__
    text = " ".join(str(error).split()) or "no message"
    return UnusableInput(
        f"model {where} raised {kind}{_place(error)}: {text}; mend the model"
        f"{_constant_source(error)}{_elsewhere(text)}{_to_install(error)}"
    )


def _elsewhere(text: str) -> str:
    """Return where a name is that the front door does not have; empty elsewhere."""
    wanted = re.match(r"cannot import name '(\w+)' from 'bondsight'", text)
    if wanted is None or not hasattr(importlib.import_module("bondgraph"), wanted[1]):
        return ""
    return f": from bondgraph import {wanted[1]}"


def _to_install(error: BaseException) -> str:
    """Return how a package that a model asks for is got; empty elsewhere."""
    if not isinstance(error, ModuleNotFoundError) or not error.name:
        return ""
    return f", or pip install {error.name.partition('.')[0]}"


def _constant_source(error: BaseException) -> str:
    """Return how a constant source is written, where one was given a value; empty elsewhere."""
    given = re.match(r"(Se|Sf)(?:\.__init__\(\) got .*argument|: no argument 'value')", str(error))
    if not isinstance(error, TypeError) or given is None:
        return ""
    called = given[1]
    kind = "effort" if called == "Se" else "flow"
    return (
        f"; {called} is recorded and has no value: a constant {kind} is M{called}(name, value, "
        "unit=...)"
    )


def _place(error: BaseException) -> str:
    """Return the last line that belongs to the model, as `` at place``; empty if there is none."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f" at line {error.lineno}"
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if _of_the_model(f.filename)]
    return f" at {Path(own[-1].filename).name} line {own[-1].lineno}" if own else ""


def _of_the_model(file: str) -> bool:
    return not file.startswith("<") and not any(
        Path(file).is_relative_to(k) for k in _NOT_THE_MODEL
    )
