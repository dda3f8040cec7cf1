"""Recordings: named channels in SI on one time base, read once from a file and then frozen.

Sizes: N samples. Units are checked and converted to SI at this border and nowhere else.
"""

from __future__ import annotations

import csv
import hashlib
import html
import os
import tempfile
import zipfile
from array import array
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.errors import UnusableInput, unknown_name
from bondgraph.units import Unit, parse_unit, split_header

__all__ = ["Channel", "Recording", "Split", "default_split"]

FloatArray = NDArray[np.float64]

_MAX_BYTES = 2**31
_EVEN, _MILD = 0.01, 0.20


# --- values ---------------------------------------------------------------------------------


def _frozen(values: ArrayLike) -> FloatArray:
    """Return values as a float64 array nobody can write to."""
    out = np.asarray(values, dtype=np.float64)
    if out.flags.writeable:
        out = out.copy()
        out.flags.writeable = False
    return out


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """One recorded quantity; `numpy.asarray(channel)` gives its values.

    Parameters
    ----------
    name : str
        Its name.
    unit : str
        SI unit of the values.
    values : ndarray
        (N,), float64, SI, read-only.
    """

    name: str
    unit: str
    values: FloatArray

    def __post_init__(self) -> None:
        """Freeze the values."""
        object.__setattr__(self, "values", _frozen(self.values))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Return the values as an array."""
        return np.array(self.values, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        """Return name, unit and length."""
        return f"Channel({self.name} [{self.unit}], {self.values.size} samples)"


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Channels of one record on one even time base, all in SI, all read-only.

    Parameters
    ----------
    name : str
        Name of the record, used in messages.
    time : ndarray
        (N,), s, increasing.
    channels : mapping of str to ndarray
        (N,) each, SI.
    units : mapping of str to str
        SI unit of every channel.
    source : str
        Where it came from; file name only.
    sha256 : str
        SHA-256 of the bytes of the source file; empty if there is none.
    meta : mapping
        Anything else worth keeping; `meta["notes"]` is a tuple of sentences about what reading
        changed (resampling, decimal commas, temperature differences, ...).

    Raises
    ------
    UnusableInput
        If shapes, values, time stamps, names or units cannot be used.

    Examples
    --------
    >>> r = Recording("demo", [0.0, 0.1, 0.2], {"x": [1.0, 2.0, 3.0]}, {"x": "m"})
    >>> r.n, r.fs, r.channel("x").unit
    (3, 10.0, 'm')
    """

    name: str
    time: FloatArray
    channels: Mapping[str, FloatArray]
    units: Mapping[str, str]
    source: str = ""
    sha256: str = ""
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check shapes, values and units; freeze everything."""
        time = _frozen(self.time)
        if time.ndim != 1 or time.size == 0:
            raise UnusableInput(f"{self.name}: time must be (N,) with N >= 1, not {time.shape}")
        if not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0.0):
            raise UnusableInput(f"{self.name}: time must be finite and increase; sort the samples")
        if not self.channels:
            raise UnusableInput(f"{self.name}: there is no channel; name at least one")
        channels: dict[str, FloatArray] = {}
        units: dict[str, str] = {}
        for name, raw in self.channels.items():
            _check_name(name, self.name)
            values = _frozen(raw)
            if values.shape != time.shape:
                raise UnusableInput(
                    f"{self.name}: channel {name!r} has shape {values.shape}, time {time.shape}; "
                    f"give one value per time stamp"
                )
            _check_finite(values, f"{self.name}: channel {name!r}", lambda i: f"sample {i}")
            if name not in self.units:
                raise UnusableInput(f"{self.name}: channel {name!r} has no unit; give units[...]")
            unit = parse_unit(self.units[name], f"{self.name}, channel {name!r}")
            if not unit.is_si:
                raise UnusableInput(
                    f"{self.name}: channel {name!r} is in {unit}, not SI; use "
                    f"Recording.from_arrays, which converts to {unit.si}"
                )
            channels[name], units[name] = values, unit.si
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "channels", MappingProxyType(channels))
        object.__setattr__(self, "units", MappingProxyType(units))
        object.__setattr__(self, "meta", MappingProxyType({"notes": (), **self.meta}))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by fields, so that recordings travel to worker processes."""
        return Recording, (
            self.name, self.time, dict(self.channels), dict(self.units),
            self.source, self.sha256, dict(self.meta),
        )  # fmt: skip

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        map: Mapping[str, str] | None = None,
        *,
        fs: float | None = None,
        name: str | None = None,
    ) -> Recording:
        """Read a `.csv`, `.npz` or `.mat` file and convert it to SI.

        Parameters
        ----------
        path : path
            The file. CSV: one header line, separators `,` `;` or tab; decimal commas are
            understood if the separator is not a comma. NPZ: one array per channel.
        map : mapping of str to str, optional
            Channel name -> column header, or its name without the unit, optionally with a unit:
            `{"x": "displacement_um"}`, `"displacement"`, `"displacement[um]"`. The key `t` names
            the time column. Without it every column is a channel and needs a unit.
        fs : float, optional
            Sampling rate, Hz; then a time column is ignored.
        name : str, optional
            Name of the recording; the file name without its ending if not given.

        Returns
        -------
        Recording
            SI values, with the SHA-256 of the file.

        Raises
        ------
        UnusableInput
            One line that says file, row, column and what to do.
        UnknownName
            If `map` names a column that does not exist.
        """
        file = Path(path)
        _check_file(file)
        suffix = file.suffix.lower()
        if suffix in (".csv", ".txt", ".tsv"):
            table = _read_csv(file, map, fs)
        elif suffix in (".npz", ".mat"):
            table = _read_arrays(file, map, fs)
        else:
            raise UnusableInput(
                f"{file.name}: files ending in {suffix!r} are not read; save as .csv, .npz or .mat"
            )
        made = _build(table, name or file.stem, file.name, fs)
        digest = hashlib.sha256()
        with open(file, "rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
        return replace(made, source=file.name, sha256=digest.hexdigest())

    @classmethod
    def from_arrays(
        cls,
        name: str,
        arrays: Mapping[str, ArrayLike],
        *,
        fs: float | None = None,
        map: Mapping[str, str] | None = None,
    ) -> Recording:
        """Make a recording from arrays named like column headers.

        Parameters
        ----------
        name : str
            Name of the recording.
        arrays : mapping of str to array_like
            (N,) each, by header: `{"t_s": t, "x[um]": x}`.
        fs : float, optional
            Sampling rate, Hz, in place of a time array.
        map : mapping of str to str, optional
            As in `read`.

        Returns
        -------
        Recording
            SI values.

        Raises
        ------
        UnusableInput
            As in `read`.

        Examples
        --------
        >>> r = Recording.from_arrays("demo", {"x[um]": [1.0, 2.0]}, fs=10.0)
        >>> float(r["x"][1])
        2e-06
        """
        table = _pick_arrays({k: np.asarray(v) for k, v in arrays.items()}, map, fs, name)
        return _build(table, name, name, fs)

    @property
    def n(self) -> int:
        """Number of samples N."""
        return int(self.time.size)

    @property
    def dt(self) -> float:
        """Time step, s: mean distance of the stamps; error if there is only one sample."""
        if self.n < 2:
            raise UnusableInput(f"{self.name}: one sample has no time step; record more samples")
        return float((self.time[-1] - self.time[0]) / (self.n - 1))

    @property
    def fs(self) -> float:
        """Sampling rate, Hz."""
        return 1.0 / self.dt

    @property
    def notes(self) -> tuple[str, ...]:
        """What reading and processing changed, one sentence each."""
        return tuple(self.meta["notes"])

    def channel(self, name: str) -> Channel:
        """Return one channel; `UnknownName` with the nearest names if there is none."""
        return Channel(name, self.units[name] if name in self.units else "", self[name])

    def __getitem__(self, name: str) -> FloatArray:
        """Values of a channel, (N,), SI, read-only."""
        if name not in self.channels:
            raise unknown_name("channel", name, f"recording {self.name}", self.channels)
        return self.channels[name]

    def select(self, map: Mapping[str, str]) -> Recording:
        """Return a recording of some channels under new names: `{new name: present name}`."""
        chosen = {new: self.channel(old) for new, old in map.items()}
        return replace(
            self,
            channels={new: c.values for new, c in chosen.items()},
            units={new: c.unit for new, c in chosen.items()},
        )

    def slice(self, start: int | None = None, stop: int | None = None) -> Recording:
        """Return samples `start` to `stop` (as Python slices count); the times stay.

        Raises
        ------
        UnusableInput
            If no sample is left.
        """
        part = slice(start, stop)
        if not len(range(*part.indices(self.n))):
            raise UnusableInput(f"{self.name}: slice {start}:{stop} of {self.n} samples is empty")
        return replace(
            self,
            time=self.time[part],
            channels={k: v[part] for k, v in self.channels.items()},
        )

    def decimate(self, factor: int, unfiltered: Collection[str] = ()) -> Recording:
        """Keep every `factor`-th sample after a zero-phase low-pass that prevents aliasing.

        All channels pass the same symmetric windowed-sinc filter (40 `factor` + 1 taps, Kaiser
        window, flat to 0.75 of the new Nyquist rate, 80 dB down beyond it), so a linear relation
        between them survives.

        Parameters
        ----------
        factor : int
            At least 1.
        unfiltered : collection of str
            Channels taken as they are, such as a drive that is held between samples.

        Returns
        -------
        Recording
            ceil(N / factor) samples.

        Raises
        ------
        UnusableInput
            If the factor is no whole number >= 1 or the record is shorter than 4 factors.
        """
        if isinstance(factor, bool) or int(factor) != factor or factor < 1:
            raise UnusableInput(f"{self.name}: decimate by a whole number >= 1, not {factor!r}")
        factor = int(factor)
        for name in unfiltered:
            self.channel(name)
        if factor == 1:
            return self
        if self.n < 4 * factor:
            raise UnusableInput(
                f"{self.name}: {self.n} samples are too few to decimate by {factor}; "
                f"use at most {max(1, self.n // 4)}"
            )
        half = 20 * factor
        k = np.arange(-half, half + 1)
        taps = np.sinc(0.875 * k / factor) * np.kaiser(2 * half + 1, 8.0)
        taps /= taps.sum()

        def thin(v: FloatArray) -> FloatArray:
            padded = np.pad(v, half, mode="reflect", reflect_type="odd")
            windows = np.lib.stride_tricks.sliding_window_view(padded, taps.size)
            return np.asarray(np.einsum("ij,j->i", windows[::factor], taps))

        channels = {
            c: v[::factor] if c in unfiltered else thin(v) for c, v in self.channels.items()
        }
        note = f"decimated by {factor} with a zero-phase low-pass"
        return replace(self, time=self.time[::factor], channels=channels, meta=_noted(self, note))

    def write_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write time and channels with their SI units in the header; all or nothing.

        Numbers are written so that reading gives back the same bits.

        Parameters
        ----------
        path : path
            File to write; an existing one is replaced at once at the end.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        UnusableInput
            If the file cannot be written.
        """
        file = Path(path)
        headers = ["t_s", *(f"{k}[{self.units[k]}]" for k in self.channels)]
        columns = [self.time.tolist(), *(v.tolist() for v in self.channels.values())]
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

    def to_pandas(self) -> Any:
        """Return a pandas DataFrame: index `t_s`, columns `name[unit]`."""
        pandas = _optional("pandas", "to_pandas")
        data = {f"{k}[{self.units[k]}]": np.array(v) for k, v in self.channels.items()}
        return pandas.DataFrame(data, index=pandas.Index(np.array(self.time), name="t_s"))

    @classmethod
    def from_pandas(
        cls,
        frame: Any,
        name: str = "frame",
        *,
        map: Mapping[str, str] | None = None,
        fs: float | None = None,
    ) -> Recording:
        """Make a recording from a DataFrame; a named index such as `t_s` counts as a column."""
        table = frame.reset_index() if frame.index.name else frame
        if len(set(table.columns)) != len(table.columns):
            raise UnusableInput(f"{name}: two columns have the same name; rename one")
        arrays = {str(c): table[c].to_numpy() for c in table.columns}
        return cls.from_arrays(name, arrays, map=map, fs=fs)

    def to_xarray(self) -> Any:
        """Return an xarray Dataset over `time` with units as attributes."""
        xarray = _optional("xarray", "to_xarray")
        data = {
            k: ("time", np.array(v), {"units": self.units[k]}) for k, v in self.channels.items()
        }
        coords = {"time": ("time", np.array(self.time), {"units": "s"})}
        return xarray.Dataset(data, coords=coords, attrs={"name": self.name, "sha256": self.sha256})

    def __repr__(self) -> str:
        """Return name, size, rate and channels in one line."""
        rate = f", {self.fs:.6g} Hz" if self.n > 1 else ""
        names = ", ".join(f"{k} [{u}]" for k, u in self.units.items())
        return f"Recording({self.name!r}, {self.n} samples{rate}: {names})"

    def _repr_html_(self) -> str:
        """Return a table of the channels for notebooks."""
        head = "".join(f"<th>{c}</th>" for c in ("channel", "unit", "min", "mean", "max"))
        rows = "".join(
            f"<tr><td>{html.escape(k)}</td><td>{html.escape(self.units[k])}</td>"
            f"<td>{v.min():.6g}</td><td>{v.mean():.6g}</td><td>{v.max():.6g}</td></tr>"
            for k, v in self.channels.items()
        )
        rate = f", {self.fs:.6g} Hz, {self.time[-1] - self.time[0]:.6g} s" if self.n > 1 else ""
        notes = "".join(f"<li>{html.escape(n)}</li>" for n in self.notes)
        return (
            f"<p><b>{html.escape(self.name)}</b>: {self.n} samples{rate}</p>"
            f"<table><tr>{head}</tr>{rows}</table>" + (f"<ul>{notes}</ul>" if notes else "")
        )


def _noted(recording: Recording, note: str) -> dict[str, Any]:
    return {**recording.meta, "notes": (*recording.notes, note)}


def _optional(module: str, method: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise UnusableInput(
            f"Recording.{method} needs {module}, which is not installed; "
            f"pip install {module.split('.')[0]}"
        ) from error


# --- checks ---------------------------------------------------------------------------------


def _check_name(name: str, where: str) -> None:
    if not name or name != name.strip() or any(c in ',;"[]#' or not c.isprintable() for c in name):
        raise UnusableInput(
            f"{where}: {name!r} cannot name a channel; use letters, digits and underscores"
        )
    if _means_time(name) or name.lower().endswith("fs_hz"):
        raise UnusableInput(f"{where}: channel name {name!r} means the time base; choose another")


def _check_finite(values: FloatArray, what: str, place: Callable[[int], str]) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise UnusableInput(
            f"{what}: {bad.size} of {values.size} values are NaN, infinite or empty, the first in "
            f"{place(int(bad[0]))}; remove or fill them"
        )


def _check_file(file: Path) -> None:
    if not file.exists():
        raise UnusableInput(f"{file}: there is no such file; check the path")
    if not file.is_file():
        raise UnusableInput(f"{file}: this is not a file; give the path of a .csv or .npz file")
    try:
        size = file.stat().st_size
        with open(file, "rb"):
            pass
    except OSError as error:
        raise UnusableInput(f"{file.name}: cannot be opened ({error.strerror})") from error
    if size == 0:
        raise UnusableInput(f"{file.name}: the file is empty; export the recording again")
    if size > _MAX_BYTES:
        raise UnusableInput(
            f"{file.name}: {size / 2**30:.1f} GiB is more than the {_MAX_BYTES / 2**30:.0f} GiB "
            f"read at once; cut or decimate the recording"
        )


# --- which columns --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Plan:
    """Which column becomes what: channel -> (header, unit), time and rate columns."""

    channels: dict[str, tuple[str, Unit]]
    time: tuple[str, Unit] | None
    rate: str | None

    @property
    def headers(self) -> list[str]:
        """All columns that must be read."""
        picked = [h for h, _ in self.channels.values()]
        picked += [self.time[0]] if self.time else []
        return list(dict.fromkeys(picked + ([self.rate] if self.rate else [])))


@dataclass(frozen=True, slots=True)
class _Table:
    """Columns as read, before units, with the place of every sample for messages."""

    plan: _Plan
    columns: dict[str, FloatArray]
    place: Callable[[int], str]
    notes: tuple[str, ...] = ()


def _means_time(name: str) -> bool:
    """Whether a name is the time; `T` is not, it is a temperature or a period."""
    return name == "t" or name.lower() == "time"


def _is_time(header: str) -> bool:
    base, unit = split_header(header)
    if not _means_time(base):
        return False
    return unit is None or parse_unit(unit, header).dims == (0, 0, 1, 0, 0)


def _unit_of(header: str, where: str) -> Unit:
    base, unit = split_header(header)
    if unit is None:
        raise UnusableInput(
            f"{where}, column {header!r}: no unit; name it like '{base}[um]' ('1' for a pure "
            f"number) or choose columns and units with a map (x={base}[um])"
        )
    if unit == "C" and "temp" in base.lower():
        raise UnusableInput(f"{where}, column {header!r}: C means coulomb; write degC or K")
    return parse_unit(unit, f"{where}, column {header!r}")


def _find(target: str, headers: Sequence[str], where: str) -> tuple[str, Unit]:
    """Return the column that a map entry means, and its unit."""
    target = target.strip()
    base, _, tail = target[:-1].partition("[") if target.endswith("]") else (target, "", "")
    base = base.strip()
    for wanted in dict.fromkeys((target, base)):
        if wanted in headers:
            if tail and wanted == base:
                return wanted, parse_unit(tail, f"{where}, map to {target!r}")
            return wanted, _unit_of(wanted, where)
    matches = [h for h in headers if split_header(h)[0] == base]
    if len(matches) > 1:
        raise UnusableInput(
            f"{where}: {target!r} fits the columns {', '.join(matches)}; give the full header"
        )
    if not matches:
        raise unknown_name("column", target, where, headers)
    unit = _unit_of(matches[0], where)
    if tail:
        given = parse_unit(tail, f"{where}, map to {target!r}")
        if given.dims != unit.dims or not np.isclose(given.scale, unit.scale, rtol=1e-12, atol=0):
            raise UnusableInput(
                f"{where}: the map says {target!r} but the header says {matches[0]!r}; "
                f"make the units agree"
            )
    return matches[0], unit


def _plan(
    headers: Sequence[str], map: Mapping[str, str] | None, fs: float | None, where: str
) -> _Plan:
    """Decide which columns are the channels, the time and the sampling rate."""
    seen: set[str] = set()
    for h in headers:
        if h and h in seen:
            raise UnusableInput(f"{where}: two columns are called {h!r}; rename one")
        seen.add(h)
    named = [h for h in headers if h]
    rates = [h for h in named if h.lower().endswith("fs_hz") or h.lower() == "fs[hz]"]
    times = [h for h in named if _is_time(h)]
    asked = {k: v for k, v in (map or {}).items() if not _means_time(k)}
    time_asked = [v for k, v in (map or {}).items() if _means_time(k)]
    if map is not None:
        channels = {k: _find(v, named, where) for k, v in asked.items()}
    else:
        channels = {}
        for h in named:
            if h in rates or h in times:
                continue
            base = split_header(h)[0]
            if base in channels:
                raise UnusableInput(
                    f"{where}: columns {channels[base][0]!r} and {h!r} would both be channel "
                    f"{base!r}; choose with --map {base}={h}"
                )
            channels[base] = (h, _unit_of(h, where))
    for name in channels:
        _check_name(name, where)
    if not channels:
        raise UnusableInput(f"{where}: no column holds a channel; columns: {', '.join(named)}")
    if fs is not None:
        return _Plan(channels, None, None)
    if time_asked:
        times = [_find_time(time_asked[0], named, where)]
    if len(times) > 1:
        raise UnusableInput(
            f"{where}: columns {', '.join(times)} could all be the time; choose with --map t=..."
        )
    if times:
        unit = split_header(times[0])[1]
        return _Plan(channels, (times[0], parse_unit(unit or "s", f"{where}, {times[0]}")), None)
    chosen = [h for h, _ in channels.values()]
    fitting = [r for r in rates if all(h.startswith(r[:-5]) for h in chosen)]
    if not fitting:
        raise UnusableInput(
            f"{where}: no time column; add a column 't_s' or 'fs_hz', or give the sampling rate "
            f"(columns: {', '.join(named)})"
        )
    return _Plan(channels, None, max(fitting, key=len))


def _find_time(target: str, headers: Sequence[str], where: str) -> str:
    fits = [h for h in headers if target.strip() in (h, split_header(h)[0])]
    if not fits:
        raise unknown_name("time column", target, where, headers)
    unit = split_header(fits[0])[1]
    if unit is not None and parse_unit(unit, f"{where}, {fits[0]}").dims != (0, 0, 1, 0, 0):
        raise UnusableInput(f"{where}: the time column {fits[0]!r} is not in a unit of time")
    return fits[0]


# --- files ----------------------------------------------------------------------------------


def _sniff(file: Path) -> str:
    """Return the text encoding; error for anything that is not text."""
    with open(file, "rb") as stream:
        head = stream.read(1 << 16)
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise UnusableInput(f"{file.name}: the text is UTF-16; save it as UTF-8")
    if any(b in head for b in (b"\0", b"\x01", b"\x02", b"\x03", b"\x04")):
        raise UnusableInput(
            f"{file.name}: this is a binary file, not text; export it as CSV or give it its ending"
        )
    try:
        head[: head.rfind(b"\n") + 1 or None].decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _numeric(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _read_csv(file: Path, map: Mapping[str, str] | None, fs: float | None) -> _Table:
    """Read the needed columns of a text table."""
    encoding, where = _sniff(file), file.name
    try:
        with open(file, encoding=encoding, errors="replace", newline="") as stream:
            first, skipped = "", 0
            for line in stream:
                if line.strip() and not line.lstrip().startswith("#"):
                    first = line
                    break
                skipped += 1
            delimiter = max("\t;,", key=first.count) if any(d in first for d in "\t;") else ","
            stream.seek(0)
            for _ in range(skipped):
                stream.readline()
            rows = csv.reader(stream, delimiter=delimiter)
            headers = [h.strip() for h in next(rows, [])]
            if not any(headers):
                raise UnusableInput(f"{where}: there is no header line; name the columns in line 1")
            if all(_numeric(h) for h in headers if h):
                raise UnusableInput(
                    f"{where}, row {skipped + 1}: numbers where the column names should be; "
                    f"put a header line such as 't_s,x[um]' first, without '#'"
                )
            plan = _plan(headers, map, fs, where)
            return _read_rows(rows, headers, plan, where, skipped, delimiter)
    except csv.Error as error:
        raise UnusableInput(f"{where}: not a table of numbers ({error}); export as CSV") from error
    except OSError as error:
        raise UnusableInput(f"{where}: cannot be read ({error.strerror})") from error


def _read_rows(
    rows: Any, headers: list[str], plan: _Plan, where: str, skipped: int, delimiter: str
) -> _Table:
    wanted = plan.headers
    index = [headers.index(h) for h in wanted]
    data = [array("d") for _ in wanted]
    lines = array("q")
    marks: set[str] = set()
    width = len(headers)
    for row in rows:
        line = skipped + rows.line_num
        if not any(row) or (len(row) == 1 and not row[0].strip()):
            continue
        if len(row) != width:
            hint = (
                "decimal commas need ';' between the columns"
                if delimiter == "," and len(row) == 2 * width
                else "make every row as long as the header"
            )
            raise UnusableInput(
                f"{where}, row {line}: {len(row)} cells, the header has {width}; {hint}"
            )
        lines.append(line)
        for store, i, header in zip(data, index, wanted, strict=True):
            cell = row[i]
            if delimiter != ",":
                marks.update(m for m in ".," if m in cell)
                if len(marks) > 1:
                    raise UnusableInput(
                        f"{where}, row {line}, column {header!r}: points and commas are mixed in "
                        f"the numbers ({cell!r}); use one decimal sign and no thousands sign"
                    )
                cell = cell.replace(",", ".")
            try:
                store.append(float(cell) if cell and "_" not in cell else _blank(cell))
            except ValueError:
                raise UnusableInput(
                    f"{where}, row {line}, column {header!r}: {row[i][:40]!r} is not a number; "
                    f"remove the row or correct the cell"
                ) from None
    if not lines:
        raise UnusableInput(f"{where}: there is a header but no row of numbers; export it again")
    columns = {h: np.frombuffer(d, dtype=np.float64) for h, d in zip(wanted, data, strict=True)}
    notes = ["decimal commas were read as decimal points"] if "," in marks else []
    if "" in headers:
        notes.append("columns without a name were left out")
    return _Table(plan, columns, lambda i: f"row {lines[i]}", tuple(notes))


def _blank(cell: str) -> float:
    if cell.strip():
        raise ValueError(cell)
    return float("nan")


def _read_arrays(file: Path, map: Mapping[str, str] | None, fs: float | None) -> _Table:
    """Read a NumPy archive (no pickles) or a MATLAB file up to version 7."""
    where = file.name
    try:
        if file.suffix.lower() == ".npz":
            with zipfile.ZipFile(file) as archive:
                if sum(i.file_size for i in archive.infolist()) > _MAX_BYTES:
                    raise UnusableInput(f"{where}: unpacks to too much; cut the recording")
            with np.load(file, allow_pickle=False) as stored:
                return _pick_arrays({k: stored[k] for k in stored.files}, map, fs, where)
        loadmat = _optional("scipy.io", "read of .mat").loadmat
        arrays = {
            k: v.squeeze()
            for k, v in loadmat(file).items()
            if isinstance(v, np.ndarray) and v.dtype.kind in "biuf" and not k.startswith("__")
        }
        return _pick_arrays(arrays, map, fs, where)
    except UnusableInput:
        raise
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, NotImplementedError) as error:
        raise UnusableInput(
            f"{where}: not readable as {file.suffix} ({error}); save plain number arrays again"
        ) from error


def _pick_arrays(
    arrays: Mapping[str, NDArray[Any]], map: Mapping[str, str] | None, fs: float | None, where: str
) -> _Table:
    """Choose and check the arrays that a plan needs."""
    usable = [k for k, v in arrays.items() if v.ndim or k.lower().endswith("fs_hz") or _is_time(k)]
    plan = _plan(usable, map, fs, where)
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
    return _Table(plan, columns, lambda i: f"sample {i}")


# --- time base ------------------------------------------------------------------------------


def _build(table: _Table, name: str, where: str, fs: float | None) -> Recording:
    """Check values, make the time even, convert to SI."""
    plan, notes = table.plan, list(table.notes)
    for header, values in table.columns.items():
        _check_finite(values, f"{where}, column {header!r}", table.place)
    channels = {k: unit.to_si(table.columns[h]) for k, (h, unit) in plan.channels.items()}
    units = {k: unit.si for k, (_, unit) in plan.channels.items()}
    notes += [f"channel {k!r}: {u.note}" for k, (_, u) in plan.channels.items() if u.note]
    n = next(iter(channels.values())).size
    if plan.time is not None:
        stamps = plan.time[1].to_si(table.columns[plan.time[0]])
        column = f"{where}, column {plan.time[0]!r}"
        time, note = _even_time(stamps, column, table.place)
        if note:
            channels = {k: np.interp(time, stamps, v) for k, v in channels.items()}
            notes.append(note)
    else:
        rate = fs
        if rate is None and plan.rate is not None:
            rates = table.columns[plan.rate]
            if np.any(rates != rates[0]):
                raise UnusableInput(f"{where}, column {plan.rate!r}: the rate changes; give t_s")
            rate = float(rates[0])
        if rate is None or not (np.isfinite(rate) and rate > 0.0):
            raise UnusableInput(f"{where}: the sampling rate must be positive, not {rate!r} Hz")
        time = np.arange(n) / rate
    return Recording(name, time, channels, units, where, "", {"notes": tuple(notes)})


def _even_time(t: FloatArray, where: str, place: Callable[[int], str]) -> tuple[FloatArray, str]:
    """Return the time, put on an even grid if mildly uneven, and a note if that was done."""
    if t.size < 2:
        return t, ""
    steps = np.diff(t)
    wrong = np.flatnonzero(steps <= 0.0)
    if wrong.size:
        i = int(wrong[0]) + 1
        what = "repeats the one before" if steps[i - 1] == 0.0 else "is earlier than the one before"
        raise UnusableInput(
            f"{where}, {place(i)}: the time stamp {t[i]:.9g} s {what} ({wrong.size} such rows); "
            f"sort the rows and remove duplicates"
        )
    mean = (t[-1] - t[0]) / (t.size - 1)
    typical = float(np.median(steps))
    worst = int(np.argmax(np.abs(steps - typical)))
    jitter = float(abs(steps[worst] - typical) / typical)
    if jitter <= _EVEN:
        return t, ""
    if jitter < _MILD:
        note = (
            f"uneven time (up to {100 * jitter:.2g} % of the step): resampled by linear "
            f"interpolation onto {mean:.9g} s"
        )
        return np.linspace(t[0], t[-1], t.size), note
    raise UnusableInput(
        f"{where}, {place(worst + 1)}: uneven time, a step of {steps[worst]:.6g} s where "
        f"{typical:.6g} s is usual; resample evenly, cut out the gap, or give the sampling rate if "
        f"the stamps are only rounded"
    )


# --- split ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Split:
    """Which samples fit, which samples judge.

    Parameters
    ----------
    train, test : slice
        Samples scored in the fit and held out of it.
    rule : str
        The rule in words.
    rest : slice or None
        Leading samples with a constant input: noise floor only, never scored in train.
    score_from : int
        First sample to score; a simulation may start before it to settle.
    """

    train: slice
    test: slice
    rule: str
    rest: slice | None = None
    score_from: int = 0


def default_split(
    recording: Recording, fraction: float = 1.0 / 3.0, drive: str | ArrayLike | None = None
) -> Split:
    """Hold out the last part of a record, by one stated rule.

    The last `fraction` of the samples is held out. If a drive is given: leading samples in which
    it stays within 1 % of its range for at least 2 % of the record are rest and not scored; if it
    is periodic afterwards (autocorrelation of at least 0.98 at some lag up to half the record),
    train and test are whole periods counted back from the end, at least one each, and what is
    left before the first whole period is run-in, before `score_from`.

    Parameters
    ----------
    recording : Recording
        N samples.
    fraction : float
        Held-out part, between 0 and 1 (exclusive).
    drive : str or array_like, optional
        The input: a channel name or (N,) values.

    Returns
    -------
    Split
        Slices of samples; test is empty only if there is one sample.

    Raises
    ------
    UnusableInput
        If the fraction or the shape of the drive is wrong.

    Examples
    --------
    >>> r = Recording.from_arrays("demo", {"x[m]": [0.0, 1.0, 2.0]}, fs=1.0)
    >>> default_split(r).test
    slice(2, 3, None)
    """
    if not 0.0 < fraction < 1.0:
        raise UnusableInput(f"{recording.name}: hold out between 0 and 1, not {fraction!r}")
    n, rest, period = recording.n, None, None
    if drive is not None:
        u = recording[drive] if isinstance(drive, str) else np.asarray(drive, dtype=np.float64)
        if u.shape != (n,):
            raise UnusableInput(f"{recording.name}: the drive has shape {u.shape}, not ({n},)")
        rest = _rest(u)
        period = _period(u[rest.stop if rest else 0 :])
    start = rest.stop if rest else 0
    left = n - start
    said = f"; rest of {start} samples not scored" if rest else ""
    if period is not None:
        whole = int((left + 0.5) / period)
        held = min(max(1, round(fraction * whole)), whole - 1)
        first = max(start, n - round(whole * period))
        cut = n - round(held * period)
        rule = f"last {held} of {whole} whole periods of {period:.6g} samples held out{said}"
        return Split(slice(first, cut), slice(cut, n), rule, rest, first)
    held = min(max(1, round(fraction * left)), left - 1)
    rule = f"last {fraction:.3g} of {left} samples held out{said}"
    return Split(slice(start, n - held), slice(n - held, n), rule, rest, start)


def _rest(u: FloatArray) -> slice | None:
    """Leading samples in which the drive stays within 1 % of its range, if 2 % of the record."""
    span = float(np.ptp(u))
    if span == 0.0:
        return None
    moving = np.maximum.accumulate(u) - np.minimum.accumulate(u) > 0.01 * span
    stop = int(np.argmax(moving))
    return slice(0, stop) if stop >= max(2, 0.02 * u.size) else None


def _period(u: FloatArray) -> float | None:
    """Period of a drive in samples (fractions possible), None if it does not repeat."""
    m = u.size
    if m < 8 or np.ptp(u) == 0.0:
        return None
    v = u - u.mean()
    size = 1 << (2 * m - 1).bit_length()
    spectrum = np.fft.rfft(v, size)
    lags = m // 2 + 2
    raw = np.fft.irfft(np.abs(spectrum) ** 2, size)[:lags]
    energy = np.concatenate(([0.0], np.cumsum(v * v)))
    k = np.arange(lags)
    norm = np.sqrt(energy[m - k] * (energy[m] - energy[k]))
    r = np.divide(raw, norm, out=np.zeros(lags), where=norm > 1e-12 * energy[m])
    below = np.flatnonzero(r < 0.5)
    if not below.size:
        return None
    inner = np.arange(max(1, int(below[0])), lags - 1)
    peaks = inner[(r[inner] >= r[inner - 1]) & (r[inner] >= r[inner + 1]) & (r[inner] >= 0.98)]
    if not peaks.size:
        return None
    first = int(peaks[r[peaks] >= r[peaks].max() - 0.005][0])
    period = _vertex(r, first)
    count = 2
    while count * period < lags - 2:
        near, reach = round(count * period), max(1, int(0.1 * period))
        low, high = max(1, near - reach), min(lags - 1, near + reach + 1)
        period = _vertex(r, low + int(np.argmax(r[low:high]))) / count
        count *= 2
    return period


def _vertex(r: Iterable[float] | FloatArray, k: int) -> float:
    """Place of the maximum of the parabola through three neighbours."""
    values = np.asarray(r)
    if not 0 < k < values.size - 1:
        return float(k)
    a, b, c = (float(x) for x in values[k - 1 : k + 2])
    bend = a - 2.0 * b + c
    return k + (0.5 * (a - c) / bend if bend < 0.0 else 0.0)
