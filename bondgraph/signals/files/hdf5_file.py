"""HDF5 files, and MATLAB 7.3 files, which are HDF5 with rules of their own.

Every array of numbers at any depth is a channel `group/x`. Its unit stands in its attribute `unit`
or `units` or in its name (`x_um`, `x[um]`). The time is the nearest array `t` or `time` up the
groups; in place of it stand an array `fs_hz` or an attribute `fs_hz`, `fs`, `sampling_rate` or
`sample_rate` in Hz, of the array or of a group around it. Only what lies in the file itself is
read: no links to other files, no external storage.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.checks import optional, readable
from bondgraph.signals.files.columns import ColumnTable
from bondgraph.signals.files.stored import StoredArray, pick_stored
from bondgraph.support.errors import UnusableInput

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_UNITS = ("unit", "units", "Unit", "Units")
_RATES = ("fs_hz", "fs", "sampling_rate", "sample_rate", "sampling_frequency")
_MAX_OBJECTS = 100_000


@dataclass(frozen=True, slots=True)
class Dialect:
    """How names are joined, and whether MATLAB's marks count."""

    separator: str
    matlab: bool


PLAIN = Dialect("/", False)
MATLAB = Dialect(".", True)


def is_hdf5(file: Path) -> bool:
    """Whether a file has the HDF5 signature, at the start or after a block for the user."""
    with open(file, "rb") as stream:
        for at in (0, 512, 1024, 2048):
            stream.seek(at)
            if stream.read(8) == _SIGNATURE:
                return True
    return False


def read_hdf5(
    file: Path, map: Mapping[str, str] | None, fs: float | None, dialect: Dialect = PLAIN
) -> ColumnTable:
    """Read the needed arrays of an HDF5 file."""
    where = file.name
    if not is_hdf5(file):
        raise UnusableInput(
            f"{where}: this is no HDF5 file; give it the ending of what it is, or export it again"
        )
    what = ".mat (version 7.3)" if dialect.matlab else file.suffix
    h5py = optional("h5py", f"read of {what}", "files")
    with readable(where, "HDF5"):
        with h5py.File(file, "r") as opened:
            found = list(_arrays(opened, h5py, dialect))
            return pick_stored(found, map, fs, where, dialect.separator)


def _arrays(opened: Any, h5py: Any, dialect: Dialect) -> Iterator[StoredArray]:
    nodes: list[tuple[str, Any]] = []

    def visit(name: str, node: Any) -> bool | None:
        if isinstance(node, h5py.Dataset) and not name.startswith("#"):
            nodes.append((name, node))
        return True if len(nodes) > _MAX_OBJECTS else None

    # visits what hard links reach, each once: links to other files are not followed
    opened.visititems(visit)
    if len(nodes) > _MAX_OBJECTS:
        raise UnusableInput(
            f"{Path(opened.filename).name}: more than {_MAX_OBJECTS} arrays; export one recording"
        )
    # in the order of names, which is also the file's customary one
    for name, node in nodes:
        yield from _of_dataset(name, node, opened, dialect)


def _of_dataset(name: str, node: Any, opened: Any, dialect: Dialect) -> Iterator[StoredArray]:
    path = name.replace("/", dialect.separator)
    if refusal := _refusal(node, dialect):
        yield StoredArray(path, (), partial(np.zeros, 0), refusal=refusal)
        return
    shape = tuple(int(n) for n in node.shape)
    if dialect.matlab or len(shape) > 1:
        shape = tuple(n for n in shape if n != 1)
    rate = _rate(node, opened)
    step = 1.0 / rate if rate else None
    if node.dtype.names is None:
        yield StoredArray(path, shape, partial(_whole, node), unit=_unit(node), step=step)
        return
    for field in node.dtype.names:
        inner = f"{path}{dialect.separator}{field}"
        yield StoredArray(inner, shape, partial(_field, node, field), step=step)


def _whole(node: Any) -> NDArray[Any]:
    return np.asarray(node[()])


def _field(node: Any, field: str) -> NDArray[Any]:
    return np.asarray(node.fields(field)[()])


def _refusal(node: Any, dialect: Dialect) -> str:
    """Say why a dataset is no channel; empty if it may be one."""
    kind = _text(node.attrs.get("MATLAB_class")) if dialect.matlab else ""
    if node.shape is None or (dialect.matlab and node.attrs.get("MATLAB_empty")):
        return "empty"
    if "MATLAB_object_decode" in node.attrs and dialect.matlab:
        return "a MATLAB object"
    if kind == "cell":
        return "a cell array"
    if kind == "char":
        return "text"
    if node.is_virtual or node.external:
        return "stored outside of this file"
    names = node.dtype.names
    if names is not None:
        if set(names) == {"real", "imag"}:
            return "complex"
        if any(node.dtype[n].kind not in "biuf" or node.dtype[n].shape for n in names):
            return "a table whose columns are not all numbers"
        return ""
    if node.dtype.kind == "O":
        return "an array of structures" if dialect.matlab else "text or references"
    if node.dtype.kind == "c":
        return "complex"
    return "" if node.dtype.kind in "biuf" else f"of type {node.dtype}"


def _unit(node: Any) -> str:
    for key in _UNITS:
        if key in node.attrs:
            return _text(node.attrs[key])
    return ""


def _text(value: Any) -> str:
    """Text of an attribute, which may be bytes or an array of one."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.flat[0]
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace").strip()
    return value.strip() if isinstance(value, str) else ""


def _rate(node: Any, opened: Any) -> float | None:
    """Find the sampling rate in the attributes of the array or of the groups around it, Hz."""
    while True:
        for key in _RATES:
            value = node.attrs.get(key)
            if value is not None and np.size(value) == 1:
                rate = float(np.ravel(value)[0])
                if np.isfinite(rate) and rate > 0.0:
                    return rate
        if node == opened:
            return None
        node = node.parent
