"""Recordings to files, tables and notebooks."""

from __future__ import annotations

import csv
import html
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.checks import optional
from bondgraph.signals.units import split_header
from bondgraph.support.errors import UnusableInput
from bondgraph.support.whole_file import replacing

if TYPE_CHECKING:
    from bondgraph.signals.recording import Recording


def write_csv(recording: Recording, file: Path) -> Path:
    """Write time and channels, all or nothing; numbers read back to the same bits.

    What was read in degC has the numbers of that, which are no absolute temperatures in K.
    """
    read, units = recording.read_in, recording.units
    own = {k: "degC" if read[k] == "degC" else units[k] for k in recording.channels}
    headers = ["t_s", *(f"{k}[{unit}]" for k, unit in own.items())]
    columns = [recording.time.tolist(), *(v.tolist() for v in recording.channels.values())]
    with replacing(file) as raw:
        stream = io.TextIOWrapper(raw, encoding="utf-8", newline="")
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(headers)
        writer.writerows(zip(*columns, strict=True))
        stream.flush()
        stream.detach()
    return file


def to_pandas(recording: Recording) -> Any:
    """DataFrame with index `t_s` and columns `name[unit]`."""
    pandas = optional("pandas", "to_pandas", "tables")
    data = {f"{k}[{recording.units[k]}]": np.array(v) for k, v in recording.channels.items()}
    return pandas.DataFrame(data, index=pandas.Index(np.array(recording.time), name="t_s"))


def to_xarray(recording: Recording) -> Any:
    """Dataset over `time` with units as attributes."""
    xarray = optional("xarray", "to_xarray", "tables")
    data = {
        k: ("time", np.array(v), {"units": recording.units[k]})
        for k, v in recording.channels.items()
    }
    coords = {"time": ("time", np.array(recording.time), {"units": "s"})}
    attributes = {
        "name": recording.name,
        "source": recording.source,
        "sha256": recording.sha256,
        "notes": list(recording.notes),
    }
    return xarray.Dataset(data, coords=coords, attrs=attributes)


def dataset_arrays(data: Any, name: str | None) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Arrays of a Dataset by header, and what `to_xarray` stored beside them."""
    xarray = optional("xarray", "from_xarray", "tables")
    if isinstance(data, xarray.DataArray):
        data = data.to_dataset(name=data.name if data.name is not None else "x")
    attributes = dict(data.attrs)
    called = name or str(attributes.get("name") or "dataset")
    kept: dict[str, Any] = {"name": called, "source": str(attributes.get("source", called))}
    kept["sha256"] = str(attributes.get("sha256", ""))
    notes = attributes.get("notes", ())
    kept["notes"] = (notes,) if isinstance(notes, str) else tuple(str(n) for n in notes)
    dimensions = {d for v in data.data_vars.values() for d in v.dims}
    if len(dimensions) != 1 or any(len(v.dims) != 1 for v in data.data_vars.values()):
        shapes = ", ".join(f"{k} {tuple(map(str, v.dims))}" for k, v in data.data_vars.items())
        raise UnusableInput(
            f"{called}: every variable must lie over the same single dimension ({shapes or 'none'})"
            "; select one place of the others first"
        )
    over = next(iter(dimensions))
    arrays = {_header(str(k), v.attrs): v.to_numpy() for k, v in data.data_vars.items()}
    if over in data.coords:
        stamps = data.coords[over]
        own = split_header(str(over))[1]
        unit = own or stamps.attrs.get("units", stamps.attrs.get("unit", "s"))
        plain = stamps.dtype.kind in "mM"
        arrays["t" if plain else f"t[{unit}]"] = stamps.to_numpy()
    return arrays, kept


def _header(name: str, attributes: Any) -> str:
    """Name with its unit, as a column would be headed."""
    unit = str(attributes.get("units", attributes.get("unit", "")))
    return f"{name}[{unit}]" if unit and not name.endswith(("]", ")")) else name


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
