"""A model as a file that another tool reads, written whole or not at all."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

from bondgraph.export.notations import json_text, of_program, program_of
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.whole_file import regular_target, write_atomically

if TYPE_CHECKING:
    from bondgraph.graph.bond_graph import BondGraph
    from bondgraph.laws import Law

Laws: TypeAlias = "Iterable[type[Law]]"
_Writer: TypeAlias = "Callable[[BondGraph, Path, Laws], tuple[Path, ...]]"


@dataclass(frozen=True, slots=True)
class ExportFormat:
    """A target of `export`.

    Attributes
    ----------
    write : callable
        Writes a graph, which may hold these further laws, to a path, whole or not at all;
        returns the files.
    default : str
        File name, ``{}`` for the name of the model.
    about : str
        What it is, for ``--list``.
    """

    write: _Writer
    default: str
    about: str


def export(
    graph: BondGraph, name: str, out: Path | None = None, *, laws: Laws = ()
) -> tuple[Path, ...]:
    """Write `graph` in the format `name`; returns the files written.

    Parameters
    ----------
    graph : BondGraph
    name : str
        One of `FORMATS`.
    out : Path, optional
        File; an existing folder takes the default name. For C it is the folder of the files.
        Missing folders are made, an existing file is replaced by the whole new one.

    laws : iterable of type of Law, optional
        Laws that ``json`` may hold beside those of `bondgraph.laws`.

    Raises
    ------
    UnknownName
        No such format.
    BondsightError
        The format cannot hold this model; the line says why.
    """
    require_known("format", "bondsight export", FORMATS, name)
    target = target_of(graph, name, out)
    if name != "c":  # there the target is a folder
        regular_target(target)
    return FORMATS[name].write(graph, target, laws)


def target_of(graph: BondGraph, name: str, out: Path | None = None) -> Path:
    """Return the path `export` writes to."""
    default = FORMATS[name].default.format(_file_stem(graph.name))
    if out is None:
        return Path(default)
    return out / default if out.is_dir() and name != "c" else out


def _file_stem(name: str) -> str:
    """Return the model's name without anything a path could take for more than a name."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "model"


def _text(target: Path, text: str) -> tuple[Path, ...]:
    write_atomically(target, text)
    return (target,)


def _printed(place: str) -> _Writer:
    """Return the writer of a text that a function ``module.name`` prints of a program."""
    return lambda graph, target, _: _text(target, of_program(place)(graph))


def _fmu(name: str) -> _Writer:
    def write(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
        target.parent.mkdir(parents=True, exist_ok=True)
        return (getattr(import_module("bondgraph.export.fmu"), name)(program_of(graph), target),)

    return write


def _c(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    if target.exists() and not target.is_dir():
        raise UnusableInput(f"{target}: C needs a folder for its files; give a folder as --out")
    texts = of_program("c_code.c_code")(graph)
    return tuple(file for n, text in texts.items() for file in _text(target / n, text))


def _casadi(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    return (of_program("casadi_function.casadi_functions")(graph).save(target),)


def _json(graph: BondGraph, target: Path, laws: Laws) -> tuple[Path, ...]:
    return _text(target, json_text(graph, laws))


FORMATS: Final[dict[str, ExportFormat]] = {
    "numpy": ExportFormat(
        _printed("numpy_module.numpy_module"),
        "{}_numpy.py",
        "Python module that needs NumPy only; memory included",
    ),
    "c": ExportFormat(_c, "{}_c", "folder with header, source and example in C; memory included"),
    "casadi": ExportFormat(_casadi, "{}_casadi.json", "CasADi functions; memory included"),
    "fmu2-cs": ExportFormat(
        _fmu("fmu2_cosimulation"), "{}_cs.fmu", "FMI 2.0 co-simulation; memory included"
    ),
    "fmu3-me": ExportFormat(
        _fmu("fmu3_model_exchange"), "{}_me.fmu", "FMI 3.0 model exchange; memory included"
    ),
    "modelica": ExportFormat(_printed("modelica.modelica"), "{}.mo", "Modelica model"),
    "control": ExportFormat(
        _printed("control.control_module"),
        "{}_control.py",
        "module with control.StateSpace; linear only",
    ),
    "json": ExportFormat(_json, "{}.json", "the bond graph itself, read back as a model"),
    "latex": ExportFormat(
        _printed("latex_document.document"), "{}.tex", "document of all equations"
    ),
}
"""The formats by name."""
