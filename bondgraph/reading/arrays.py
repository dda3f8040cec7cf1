"""Arrays by name: NumPy archives, MATLAB files, arrays in memory."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.errors import BondsightError, UnusableInput
from bondgraph.reading.checks import MAX_BYTES, FloatArray, optional
from bondgraph.reading.columns import Table, choose, is_time


def read_arrays(file: Path, map: Mapping[str, str] | None, fs: float | None) -> Table:
    """Read a NumPy archive (no pickles) or a MATLAB file up to version 7."""
    where = file.name
    try:
        if file.suffix.lower() == ".npz":
            with zipfile.ZipFile(file) as archive:
                if sum(i.file_size for i in archive.infolist()) > MAX_BYTES:
                    raise UnusableInput(f"{where}: unpacks to too much; cut the recording")
            with np.load(file, allow_pickle=False) as stored:
                return pick_arrays({k: stored[k] for k in stored.files}, map, fs, where)
        loadmat = optional("scipy.io", "read of .mat").loadmat
        arrays = {
            k: v.squeeze()
            for k, v in loadmat(file).items()
            if isinstance(v, np.ndarray) and v.dtype.kind in "biuf" and not k.startswith("__")
        }
        return pick_arrays(arrays, map, fs, where)
    except BondsightError:
        raise
    except Exception as error:  # what loadmat raises for a broken file is anybody's guess
        raise UnusableInput(
            f"{where}: not readable as {file.suffix} ({error}); save plain number arrays again"
        ) from error


def pick_arrays(
    arrays: Mapping[str, NDArray[Any]], map: Mapping[str, str] | None, fs: float | None, where: str
) -> Table:
    """Choose and check the arrays that a plan needs."""
    usable = [k for k, v in arrays.items() if v.ndim or k.lower().endswith("fs_hz") or is_time(k)]
    plan = choose(usable, map, fs, where)
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
        raise UnusableInput(f"{where}: arrays differ in length ({text}); choose some with --map")
    if 0 in sizes.values():
        raise UnusableInput(f"{where}: the arrays hold no sample; export the recording again")
    return Table(plan, columns, lambda i: f"sample {i}")
