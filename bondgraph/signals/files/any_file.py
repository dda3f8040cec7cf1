"""From a file to a table, by its ending; each reader is imported when it is needed."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from bondgraph.signals.files.checks import check_file
from bondgraph.signals.files.columns import ColumnTable
from bondgraph.support.errors import UnusableInput

_READERS = {
    (".csv", ".txt", ".tsv"): ("csv_file", "read_csv"),
    (".npz",): ("arrays", "read_npz"),
    (".mat",): ("mat_file", "read_mat"),
    (".h5", ".hdf5", ".hdf"): ("hdf5_file", "read_hdf5"),
    (".tdms",): ("tdms_file", "read_tdms"),
    (".parquet", ".pq"): ("parquet_file", "read_parquet"),
}
ENDINGS = tuple(e for endings in _READERS for e in endings)
"""Endings of files that are read."""


def read_table(file: Path, map: Mapping[str, str] | None, fs: float | None) -> ColumnTable:
    """Read the columns a plan needs.

    Raises
    ------
    UnusableInput, UnknownName
        As `Recording.read`.
    """
    check_file(file)
    suffix = file.suffix.lower()
    for endings, (module, name) in _READERS.items():
        if suffix in endings:
            reader = getattr(import_module(f"bondgraph.signals.files.{module}"), name)
            table = reader(file, map, fs)
            assert isinstance(table, ColumnTable)
            return table
    raise UnusableInput(
        f"{file.name}: files ending in {suffix!r} are not read; save as one of {', '.join(ENDINGS)}"
    )
