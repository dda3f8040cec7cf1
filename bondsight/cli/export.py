"""``bondsight export``: a model as a file that another tool reads, written whole or not at all."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.support import native
from bondgraph.support.errors import UnusableInput, unknown_name
from bondgraph.support.whole_file import regular_target, write_atomically

__all__ = ["FORMATS", "Format", "add_export_command", "export", "target_of"]


@dataclass(frozen=True, slots=True)
class Format:
    """A target of the command.

    Attributes
    ----------
    write : callable
        Writes a graph to a path, whole or not at all; returns the files.
    default : str
        File name, ``{}`` for the name of the model.
    about : str
        What it is, for ``--list``.
    """

    write: Callable[[BondGraph, Path], tuple[Path, ...]]
    default: str
    about: str


def export(graph: BondGraph, name: str, out: Path | None = None) -> tuple[Path, ...]:
    """Write `graph` in the format `name`; returns the files written.

    Parameters
    ----------
    graph : BondGraph
    name : str
        One of `FORMATS`.
    out : Path, optional
        File; an existing folder takes the default name. For C it is the folder of the files.
        Missing folders are made, an existing file is replaced by the whole new one.

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
    return FORMATS[name].write(graph, target)


def target_of(graph: BondGraph, name: str, out: Path | None = None) -> Path:
    """Return the path `export` writes to."""
    default = FORMATS[name].default.format(_file_stem(graph.name))
    if out is None:
        return Path(default)
    return out / default if out.is_dir() and name != "c" else out


def add_export_command(verbs: Any) -> None:
    """Add ``export`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("export", help="write a model for another tool")
    p.add_argument("model", nargs="?", help=MODEL)
    p.add_argument("--format", choices=tuple(FORMATS), default=None)
    p.add_argument("--out", type=Path, default=None, metavar="PATH", help="file (C: folder)")
    p.add_argument("--list", action="store_true", help="list the formats")
    p.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.list:
        for name, f in FORMATS.items():
            print(f"{name:10s} {f.default.format('MODEL'):22s} {f.about}")
        return 0
    if options.model is None or options.format is None:
        missing = "MODEL" if options.model is None else "--format"
        raise UnusableInput(
            f"export needs {missing}: bondsight export MODEL --format {'|'.join(FORMATS)}"
        )
    from bondsight.cli.models import load_model

    graph = load_model(options.model)
    graph.require_sound()
    target = target_of(graph, options.format, options.out)
    if target.resolve() == Path(options.model).resolve():
        raise UnusableInput(f"{target} is the model itself; give another --out")
    for file in export(graph, options.format, options.out):
        print(file)
    if options.format.startswith("fmu") and native.compiler() is None:
        print("no C compiler found: the archive has sources only", file=sys.stderr)
    return 0


def _file_stem(name: str) -> str:
    """Return the model's name without anything a path could take for more than a name."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "model"


def _program(graph: BondGraph) -> Any:
    from bondgraph.equations.codegen import program

    return program(graph)


def _text(target: Path, text: str) -> tuple[Path, ...]:
    write_atomically(target, text)
    return (target,)


def _numpy(graph: BondGraph, target: Path) -> tuple[Path, ...]:
    from bondgraph.export.numpy_module import numpy_module

    return _text(target, numpy_module(_program(graph)))


def _c(graph: BondGraph, target: Path) -> tuple[Path, ...]:
    from bondgraph.export.c_code import c_code

    if target.exists() and not target.is_dir():
        raise UnusableInput(f"{target}: C needs a folder for its files; give a folder as --out")
    texts = c_code(_program(graph))
    return tuple(file for n, text in texts.items() for file in _text(target / n, text))


def _casadi(graph: BondGraph, target: Path) -> tuple[Path, ...]:
    from bondgraph.export.casadi_function import casadi_functions

    return (casadi_functions(_program(graph)).save(target),)


def _fmu2(graph: BondGraph, target: Path) -> tuple[Path, ...]:
    from bondgraph.export.fmu import fmu2_cosimulation

    target.parent.mkdir(parents=True, exist_ok=True)
    return (fmu2_cosimulation(_program(graph), target),)


def _fmu3(graph: BondGraph, target: Path) -> tuple[Path, ...]:
    from bondgraph.export.fmu import fmu3_model_exchange

    target.parent.mkdir(parents=True, exist_ok=True)
    return (fmu3_model_exchange(_program(graph), target),)


def _modelica(graph: BondGraph, target: Path) -> tuple[Path, ...]:
    from bondgraph.export.modelica import modelica

    return _text(target, modelica(_program(graph)))


def _control(graph: BondGraph, target: Path) -> tuple[Path, ...]:
    from bondgraph.export.control import control_module

    return _text(target, control_module(_program(graph)))


def _json(graph: BondGraph, target: Path) -> tuple[Path, ...]:
    from bondgraph.export.graph_json.write_graph import to_json
    from bondsight.cli.models import FURTHER_LAWS

    return _text(target, to_json(graph, laws=FURTHER_LAWS))


def _latex(graph: BondGraph, target: Path) -> tuple[Path, ...]:
    from bondgraph.export.latex_document import document

    return _text(target, document(_program(graph)))


FORMATS: Final[dict[str, Format]] = {
    "numpy": Format(_numpy, "{}_numpy.py", "Python module that needs NumPy only; memory included"),
    "c": Format(_c, "{}_c", "folder with header, source and example in C; memory included"),
    "casadi": Format(_casadi, "{}_casadi.json", "CasADi functions; memory included"),
    "fmu2-cs": Format(_fmu2, "{}_cs.fmu", "FMI 2.0 co-simulation; memory included"),
    "fmu3-me": Format(_fmu3, "{}_me.fmu", "FMI 3.0 model exchange; memory included"),
    "modelica": Format(_modelica, "{}.mo", "Modelica model"),
    "control": Format(_control, "{}_control.py", "module with control.StateSpace; linear only"),
    "json": Format(_json, "{}.json", "the bond graph itself, read back as a model"),
    "latex": Format(_latex, "{}.tex", "document of all equations"),
}
"""The formats of the command by name."""
