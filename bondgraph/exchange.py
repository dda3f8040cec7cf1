"""Recordings to files, tables and notebooks."""

from __future__ import annotations

import csv
import html
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.errors import UnusableInput
from bondgraph.reading.checks import optional

if TYPE_CHECKING:
    from bondgraph.signals import Recording


def write_csv(recording: Recording, file: Path) -> Path:
    """Write time and channels, all or nothing; numbers read back to the same bits."""
    headers = ["t_s", *(f"{k}[{recording.units[k]}]" for k in recording.channels)]
    columns = [recording.time.tolist(), *(v.tolist() for v in recording.channels.values())]
    temporary: str | None = None
    try:
        handle, temporary = tempfile.mkstemp(dir=file.parent, suffix=".part")
        with open(handle, "w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(headers)
            writer.writerows(zip(*columns, strict=True))
        os.chmod(temporary, 0o644)
        os.replace(temporary, file)
    except OSError as error:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)
        raise UnusableInput(f"{file.name}: cannot be written ({error.strerror})") from error
    return file


def to_pandas(recording: Recording) -> Any:
    """DataFrame with index `t_s` and columns `name[unit]`."""
    pandas = optional("pandas", "to_pandas")
    data = {f"{k}[{recording.units[k]}]": np.array(v) for k, v in recording.channels.items()}
    return pandas.DataFrame(data, index=pandas.Index(np.array(recording.time), name="t_s"))


def to_xarray(recording: Recording) -> Any:
    """Dataset over `time` with units as attributes."""
    xarray = optional("xarray", "to_xarray")
    data = {
        k: ("time", np.array(v), {"units": recording.units[k]})
        for k, v in recording.channels.items()
    }
    coords = {"time": ("time", np.array(recording.time), {"units": "s"})}
    return xarray.Dataset(
        data, coords=coords, attrs={"name": recording.name, "sha256": recording.sha256}
    )


def to_html(recording: Recording) -> str:
    """Table of the channels."""
    head = "".join(f"<th>{c}</th>" for c in ("channel", "unit", "min", "mean", "max"))
    rows = "".join(
        f"<tr><td>{html.escape(k)}</td><td>{html.escape(recording.units[k])}</td>"
        f"<td>{v.min():.6g}</td><td>{v.mean():.6g}</td><td>{v.max():.6g}</td></tr>"
        for k, v in recording.channels.items()
    )
    rate = (
        f", {recording.fs:.6g} Hz, {recording.time[-1] - recording.time[0]:.6g} s"
        if recording.n > 1
        else ""
    )
    notes = "".join(f"<li>{html.escape(n)}</li>" for n in recording.notes)
    return (
        f"<p><b>{html.escape(recording.name)}</b>: {recording.n} samples{rate}</p>"
        f"<table><tr>{head}</tr>{rows}</table>" + (f"<ul>{notes}</ul>" if notes else "")
    )


def regular_target(target: Path) -> Path:
    """Return where a file is really to be written, links followed.

    Raises
    ------
    UnusableInput
        It exists and is no regular file: a folder, a device, a pipe.
    """
    real = target.resolve()
    if real.exists() and not real.is_file():
        raise UnusableInput(f"{target} exists and is no regular file; give another --out")
    return real
