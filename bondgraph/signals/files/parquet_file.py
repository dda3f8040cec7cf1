"""Parquet tables: one column a channel, its unit in the metadata of the column or in its name."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.checks import check_total, optional, readable
from bondgraph.signals.files.columns import ColumnTable
from bondgraph.signals.files.stored import StoredArray, pick_stored
from bondgraph.support.errors import UnusableInput

_UNITS = (b"unit", b"units")
_INDEX = "__index_level_"
_MAGIC = b"PAR1"


def read_parquet(file: Path, map: Mapping[str, str] | None, fs: float | None) -> ColumnTable:
    """Read the needed columns of a Parquet file; a missing value counts as NaN."""
    where = file.name
    with open(file, "rb") as stream:
        first = stream.read(4)
        stream.seek(-min(4, file.stat().st_size), 2)
        last = stream.read(4)
    if first != _MAGIC or last != _MAGIC:
        what = "is cut off" if first == _MAGIC else "is no Parquet file"
        raise UnusableInput(f"{where}: this {what}; export the recording again")
    parquet = optional("pyarrow.parquet", "read of .parquet", "files")
    with readable(where, "Parquet"):
        with parquet.ParquetFile(file) as opened:
            rows = int(opened.metadata.num_rows)
            schema = opened.schema_arrow
            if len(set(schema.names)) < len(schema.names):
                twice = next(n for n in schema.names if schema.names.count(n) > 1)
                raise UnusableInput(f"{where}: two columns are called {twice!r}; rename one")
            check_total(rows * 8, where)
            found = [_column(f, rows, opened) for f in schema if not f.name.startswith(_INDEX)]
            return pick_stored(found, map, fs, where)


def _column(field: Any, rows: int, opened: Any) -> StoredArray:
    text = str(field.type)
    number = text.startswith(("int", "uint", "float", "double", "halffloat", "bool"))
    stamp = text.startswith(("timestamp", "duration"))
    if not (number or stamp):
        return StoredArray(field.name, (), partial(np.zeros, 0), refusal=f"a column of {text}")
    metadata = field.metadata or {}
    unit = next((metadata[k].decode("utf-8", "replace") for k in _UNITS if k in metadata), "")
    return StoredArray(field.name, (rows,), partial(_values, opened, field.name), unit=unit.strip())


def _values(opened: Any, name: str) -> NDArray[Any]:
    column = opened.read(columns=[name]).column(0)
    return np.asarray(column.to_numpy())
