"""MATLAB files: version 5 to 7 through SciPy, version 7.3 (an HDF5 file) through h5py.

Fields of a structure are reached as MATLAB writes them, `data.x`, in both kinds of file; a map may
also say `data/x`.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bondgraph.signals.files import checks
from bondgraph.signals.files.checks import optional, readable
from bondgraph.signals.files.columns import ColumnTable
from bondgraph.signals.files.hdf5_file import MATLAB, is_hdf5, read_hdf5
from bondgraph.signals.files.stored import StoredArray, pick_stored

_COMPRESSED = 15
_DEPTH = 20


def read_mat(file: Path, map: Mapping[str, str] | None, fs: float | None) -> ColumnTable:
    """Read a `.mat` file of any version."""
    where = file.name
    if is_hdf5(file):
        return read_hdf5(file, map, fs, MATLAB)
    loadmat = optional("scipy.io", "read of .mat").loadmat
    with readable(where, ".mat", "save plain number arrays again"):
        check_unpacked(file)
        variables = loadmat(file)
        found = [
            s for k, v in variables.items() if not k.startswith("__") for s in _flat(k, v, _DEPTH)
        ]
        return pick_stored(found, map, fs, where, ".")


def check_unpacked(file: Path) -> None:
    """Refuse a version 5 file whose compressed variables unpack to too much."""
    if file.stat().st_size * 1100 < checks.MAX_BYTES:
        return  # deflate gains no more than that
    total = 0
    with open(file, "rb") as stream:
        head = stream.read(128)
        order = "<" if head[126:128] == b"IM" else ">"
        while len(tag := stream.read(8)) == 8:
            kind, size = (int(n) for n in np.frombuffer(tag, dtype=f"{order}u4"))
            if kind != _COMPRESSED:
                stream.seek(size, 1)
                continue
            unpack = zlib.decompressobj()
            while size > 0 and (block := stream.read(min(size, 1 << 20))):
                size -= len(block)
                while block:
                    total += len(unpack.decompress(block, 1 << 24))
                    block = unpack.unconsumed_tail
                    checks.check_total(total, file.name)


def _flat(path: str, value: Any, depth: int) -> Iterator[StoredArray]:
    """Arrays inside one variable."""
    refusal = ""
    if not isinstance(value, np.ndarray):
        refusal = "a sparse matrix" if hasattr(value, "tocoo") else "no array"
    elif type(value).__name__ in ("MatlabOpaque", "MatlabFunction", "MatlabObject"):
        refusal = "a MATLAB object"
    elif value.dtype.names:
        if value.size == 1 and depth:
            for name in value.dtype.names:
                yield from _flat(f"{path}.{name}", value.flat[0][name], depth - 1)
            return
        refusal = "an array of structures"
    elif value.dtype.kind == "O":
        refusal = "a cell array"
    elif value.dtype.kind in "US":
        refusal = "text"
    elif value.dtype.kind == "c":
        refusal = "complex"
    if refusal:
        yield StoredArray(path, (), partial(np.zeros, 0), refusal=refusal)
        return
    yield StoredArray(path, value.squeeze().shape, partial(np.asarray, value))
