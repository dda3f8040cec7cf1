"""A model as a file that another tool reads, written whole or not at all."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from bondgraph.support.errors import UnusableInput, unknown_name
from bondgraph.support.whole_file import regular_target, write_atomically

if TYPE_CHECKING:
    from bondgraph.graph.bond_graph import BondGraph
    from bondgraph.laws import Law

__all__ = ["FORMATS", "ExportFormat", "export", "target_of"]

Laws: TypeAlias = "Iterable[type[Law]]"


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

    write: Callable[[BondGraph, Path, Laws], tuple[Path, ...]]
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
    if name not in FORMATS:
        raise unknown_name("format", name, "bondsight export", FORMATS)
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


def _program(graph: BondGraph) -> Any:
    from bondgraph.equations.codegen import program

    return program(graph)


def _text(target: Path, text: str) -> tuple[Path, ...]:
    write_atomically(target, text)
    return (target,)


def _numpy(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    from bondgraph.export.numpy_module import numpy_module

    return _text(target, numpy_module(_program(graph)))


def _c(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    from bondgraph.export.c_code import c_code

    if target.exists() and not target.is_dir():
        raise UnusableInput(f"{target}: C needs a folder for its files; give a folder as --out")
    texts = c_code(_program(graph))
    return tuple(file for n, text in texts.items() for file in _text(target / n, text))


def _casadi(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    from bondgraph.export.casadi_function import casadi_functions

    return (casadi_functions(_program(graph)).save(target),)


def _fmu2(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    from bondgraph.export.fmu import fmu2_cosimulation

    target.parent.mkdir(parents=True, exist_ok=True)
    return (fmu2_cosimulation(_program(graph), target),)


def _fmu3(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    from bondgraph.export.fmu import fmu3_model_exchange

    target.parent.mkdir(parents=True, exist_ok=True)
    return (fmu3_model_exchange(_program(graph), target),)


def _modelica(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    from bondgraph.export.modelica import modelica

    return _text(target, modelica(_program(graph)))


def _control(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    from bondgraph.export.control import control_module

    return _text(target, control_module(_program(graph)))


def _json(graph: BondGraph, target: Path, laws: Laws) -> tuple[Path, ...]:
    from bondgraph.export.graph_json.write_graph import to_json

    return _text(target, to_json(graph, laws=laws))


def _latex(graph: BondGraph, target: Path, _: Laws) -> tuple[Path, ...]:
    from bondgraph.export.latex_document import document

    return _text(target, document(_program(graph)))


FORMATS: Final[dict[str, ExportFormat]] = {
    "numpy": ExportFormat(
        _numpy, "{}_numpy.py", "Python module that needs NumPy only; memory included"
    ),
    "c": ExportFormat(_c, "{}_c", "folder with header, source and example in C; memory included"),
    "casadi": ExportFormat(_casadi, "{}_casadi.json", "CasADi functions; memory included"),
    "fmu2-cs": ExportFormat(_fmu2, "{}_cs.fmu", "FMI 2.0 co-simulation; memory included"),
    "fmu3-me": ExportFormat(_fmu3, "{}_me.fmu", "FMI 3.0 model exchange; memory included"),
    "modelica": ExportFormat(_modelica, "{}.mo", "Modelica model"),
    "control": ExportFormat(
        _control, "{}_control.py", "module with control.StateSpace; linear only"
    ),
    "json": ExportFormat(_json, "{}.json", "the bond graph itself, read back as a model"),
    "latex": ExportFormat(_latex, "{}.tex", "document of all equations"),
}
"""The formats by name."""
