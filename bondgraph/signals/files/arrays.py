"""Arrays by name: in memory, and in NumPy archives."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.checks import check_total, readable
from bondgraph.signals.files.columns import ColumnTable, choose, is_rate, is_stamp, is_time
from bondgraph.signals.units import parse_unit
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput


def read_npz(file: Path, map: Mapping[str, str] | None, fs: float | None) -> ColumnTable:
    """Read a NumPy archive; arrays of objects (pickles) are refused, not opened."""
    where = file.name
    with readable(where, ".npz", "save plain number arrays again"):
        with zipfile.ZipFile(file) as archive:
            names = archive.namelist()
            check_total(sum(i.file_size for i in archive.infolist()), where)
        twice = sorted({n for n in names if names.count(n) > 1}) if len(names) < 10_000 else []
        if twice:
            raise UnusableInput(f"{where}: two arrays are called {twice[0]!r}; save it again")
        with np.load(file, allow_pickle=False) as stored:
            arrays = {k: stored[k] for k in stored.files}
        # an entry that is no array comes as bytes
        arrays = {k: v for k, v in arrays.items() if isinstance(v, np.ndarray)}
        return pick_arrays(arrays, map, fs, where)


def pick_arrays(
    arrays: Mapping[str, NDArray[Any]], map: Mapping[str, str] | None, fs: float | None, where: str
) -> ColumnTable:
    """Choose and check the arrays that a plan needs.

    Time stamps of a calendar count from the first; durations become seconds.
    """
    notes: list[str] = []
    given = arrays
    arrays = {k: _seconds(v, k, notes) for k, v in given.items()}
    usable = [k for k, v in arrays.items() if v.ndim or is_rate(k) or is_time(k)]
    plan = choose(usable, map, fs, where)
    if plan.time and arrays[plan.time[0]] is not given[plan.time[0]]:
        # these are seconds by now, whatever the header says
        plan = replace(plan, time=(plan.time[0], parse_unit("s")))
    columns: dict[str, FloatArray] = {}
    sizes: dict[str, int] = {}
    for header in plan.headers:
        raw = arrays[header]
        if raw.dtype.kind not in "biuf":
            raise UnusableInput(f"{where}, array {header!r}: holds {raw.dtype}, not real numbers")
        if raw.ndim > 1:
            raise UnusableInput(
                f"{where}, array {header!r}: shape {raw.shape}; store one (N,) array per channel"
            )
        columns[header] = np.atleast_1d(raw).astype(np.float64)
        if header != plan.rate:
            sizes[header] = columns[header].size
    if len(set(sizes.values())) > 1:
        text = ", ".join(f"{k} {v}" for k, v in sizes.items())
        raise UnusableInput(
            f"{where}: arrays differ in length ({text})",
            remedies=["choose some with map={NAME: COLUMN}"],
        )
    if 0 in sizes.values():
        raise UnusableInput(f"{where}: the arrays hold no sample; export the recording again")
    used = [n for n in notes if any(n.startswith(repr(h)) for h in plan.headers)]
    return ColumnTable(plan, columns, lambda i: f"sample {i}", tuple(used))


def _seconds(values: NDArray[Any], header: str, notes: list[str]) -> NDArray[Any]:
    """Return calendar times and durations as seconds, others as they are."""
    clock = is_time(header) or is_stamp(header)
    if values.dtype.kind not in "mM" or not clock or not values.size:
        return values
    first = values.flat[0]
    missing = np.isnat(values)
    if values.dtype.kind == "M":
        notes.append(f"{header!r}: seconds since {first}")
        values = values - first
    # two steps: whole seconds are exact, the rest is below one
    whole = values.astype("timedelta64[s]")
    rest = (values - whole).astype("timedelta64[ns]").astype(np.int64)
    out = whole.astype(np.int64).astype(np.float64) + rest * 1e-9
    return np.where(missing, np.nan, out)
