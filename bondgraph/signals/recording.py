"""Recordings: named channels in SI on one time base, read once from a file and then frozen.

Sizes: N samples. Units are checked and converted to SI at this border and nowhere else.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.drawing.panels import Panels
from bondgraph.signals.decimation import thinned
from bondgraph.signals.files.any_file import read_table
from bondgraph.signals.files.arrays import pick_arrays
from bondgraph.signals.files.checks import (
    check_file,
    check_finite,
    check_name,
    frozen,
    require_map,
)
from bondgraph.signals.files.columns import OTHERS
from bondgraph.signals.files.time_base import TIME, Even, make_even, with_others
from bondgraph.signals.interop import dataset_arrays, to_html, to_pandas, to_xarray, write_csv
from bondgraph.signals.recording_file import is_saved, open_fields, save_recording, sha256_of
from bondgraph.signals.split import Split, default_split
from bondgraph.signals.units import parse_unit, read_unit
from bondgraph.signals.wrapping import unwrapped
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.spelled import spelled

__all__ = ["Channel", "Recording", "Split", "default_split"]


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
        object.__setattr__(self, "values", frozen(self.values))

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
        changed (resampling, decimal commas, temperature differences, ...);
        `meta["resolution"]`, by channel, the unit of a coarse converter, SI; `meta["noise"]`, by
        channel, the standard deviation of a noise that is known, SI; `meta["read_in"]`, by channel
        (and `time`), the unit of the numbers as they were read, where it is not SI;
        `meta["left_out"]`, which columns a map that does not name them has left out, and why.

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
        time = frozen(self.time)
        if time.ndim != 1 or time.size == 0:
            raise UnusableInput(f"{self.name}: time must be (N,) with N >= 1, not {time.shape}")
        if not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0.0):
            raise UnusableInput(f"{self.name}: time must be finite and increase; sort the samples")
        if not self.channels:
            raise UnusableInput(f"{self.name}: there is no channel; name at least one")
        channels: dict[str, FloatArray] = {}
        units: dict[str, str] = {}
        for name, raw in self.channels.items():
            check_name(name, self.name)
            values = frozen(raw)
            if values.shape != time.shape:
                raise UnusableInput(
                    f"{self.name}: channel {name!r} has shape {values.shape}, time {time.shape}; "
                    f"give one value per time stamp"
                )
            check_finite(values, f"{self.name}: channel {name!r}", lambda i: f"sample {i}")
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
    @spelled
    def read(
        cls,
        path: str | os.PathLike[str],
        map: Mapping[str, str] | None = None,
        *,
        fs: float | None = None,
        name: str | None = None,
        rows: tuple[int | None, int | None] = (None, None),
        resample: float | None = None,
        fill: int = 0,
    ) -> Recording:
        """Read a file of measurements and convert it to SI.

        Parameters
        ----------
        path : path
            The file. CSV: one header line, and whatever an instrument writes above it; separators
            `,` `;` or tab; decimal commas are understood if the separator is not a comma. Units
            may stand in a line of their own, stamps as ISO 8601 dates. NPZ, MAT (all versions),
            HDF5: one array per channel; TDMS: one channel each; Parquet: one column each. Arrays
            in groups are called `group/x`, fields of MATLAB structures `data.x`. A file that `save`
            wrote is opened; MAT 7.3, HDF5, TDMS and Parquet need
            ``pip install 'bondsight[files]'``.
        map : mapping of str to str, optional
            Channel name -> column header, or its name without the unit, optionally with a unit:
            `{"x": "displacement_um"}`, `"displacement"`, `"displacement[um]"`. The key `t` names
            the time column. Only what differs need be written: columns that it does not name are
            channels under their own names where they can be read, else left out, and `notes` says
            so; the entry `"*": ""` leaves all others out. Without a map every column is a channel
            and needs a unit.
        fs : float, optional
            Sampling rate, Hz; then a time column is ignored.
        name : str, optional
            Name of the recording; the file name without its ending if not given.
        rows : tuple of (int or None, int or None)
            First and last row that are kept, by the numbers that errors use.
        resample : float, optional
            Samples a second of an even grid, Hz, for stamps that are uneven.
        fill : int
            Across so many missing samples in a row (empty, NaN, or left out by the stamps) straight
            lines are drawn, which `notes` says; none if left out.

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
        check_file(file)
        if is_saved(file):
            if fs is not None:
                raise UnusableInput(
                    f"{file.name}: a saved recording has its own time; leave the sampling rate out"
                )
            if rows != (None, None) or resample is not None or fill:
                raise UnusableInput(
                    f"{file.name}: a saved recording has no rows to choose nor stamps to resample "
                    "nor gaps to fill; open it and use slice"
                )
            saved = cls.open(file)
            named = replace(saved, name=name) if name else saved
            require_map(map)
            return named.select({**map, OTHERS: map.get(OTHERS, OTHERS)}) if map else named

        def reading(chosen: Mapping[str, str] | None) -> Even:
            table = read_table(file, chosen, fs)
            if rows != (None, None):
                table = table.kept(*rows, file.name)
            return make_even(table, file.name, fs, resample, fill)

        even = with_others(reading, map)
        return cls(
            name or file.stem, even.time, even.channels, even.units,
            file.name, sha256_of(file), _origin(even),
        )  # fmt: skip

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Recording:
        """Reopen what `save` wrote: every bit, and the provenance.

        Parameters
        ----------
        path : path
            The file.

        Returns
        -------
        Recording
            Equal to the saved one in all fields.

        Raises
        ------
        UnusableInput
            One line: no such file, damaged, changed, or saved by a newer version.
        """
        return cls(**open_fields(Path(path)))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything to one open file, all or nothing; `open` gives it back.

        The file is a NumPy archive without pickles: one array per channel, and a JSON entry with
        units, source, SHA-256 of the source, notes and the software version. Equal recordings give
        equal bytes.

        Parameters
        ----------
        path : path
            File to write, ending in `.npz`; an existing one is replaced at once at the end.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        UnusableInput
            If the ending is another, `meta` holds more than plain values, or the file cannot be
            written.

        Examples
        --------
        >>> import tempfile
        >>> r = Recording("demo", [0.0, 0.1], {"x": [1.0, 2.0]}, {"x": "m"})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     Recording.open(r.save(Path(folder) / "demo.npz"))
        Recording('demo', 2 samples, 10 Hz: x [m])
        """
        return save_recording(self, Path(path))

    @classmethod
    @spelled
    def from_arrays(
        cls,
        name: str,
        arrays: Mapping[str, ArrayLike],
        *,
        fs: float | None = None,
        map: Mapping[str, str] | None = None,
        fill: int = 0,
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
        fill : int
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
        given = {k: np.asarray(v) for k, v in arrays.items()}
        even = with_others(
            lambda chosen: make_even(pick_arrays(given, chosen, fs, name), name, fs, fill=fill), map
        )
        return cls(name, even.time, even.channels, even.units, name, meta=_origin(even))

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

    @property
    def read_in(self) -> dict[str, str]:
        """Unit of the numbers of each channel, and of `time`, as they were read."""
        stated = self.meta.get("read_in")
        known = dict(stated) if isinstance(stated, Mapping) else {}
        said = {n: u for n, u in known.items() if isinstance(u, str) and read_unit(u) is not None}
        return {n: said.get(n, u) for n, u in {**self.units, TIME: "s"}.items()}

    def channel(self, name: str) -> Channel:
        """Return one channel; `UnknownName` with the nearest names if there is none."""
        return Channel(name, self.units[name] if name in self.units else "", self[name])

    def __getitem__(self, name: str) -> FloatArray:
        """Values of a channel, (N,), SI, read-only."""
        require_known("channel", f"recording {self.name}", self.channels, name)
        return self.channels[name]

    def select(self, map: Mapping[str, str]) -> Recording:
        """Return a recording of some channels under new names: `{new name: present name}`.

        The entry `"*": "*"` keeps all others under their own.
        """
        if OTHERS in map:
            others = [n for n in self.channels if n not in map and n not in map.values()]
            others = others if map[OTHERS] else []
            pairs = [(k, v) for k, v in map.items() if k != OTHERS]
            at = list(map).index(OTHERS)
            map = dict([*pairs[:at], *zip(others, others, strict=True), *pairs[at:]])
        chosen = {new: self.channel(old) for new, old in map.items()}
        meta = dict(self.meta)
        for key in ("resolution", "noise", "read_in"):
            if isinstance(known := meta.get(key), Mapping):
                meta[key] = {new: known[old] for new, old in map.items() if old in known}
                if TIME in known:
                    meta[key][TIME] = known[TIME]
        return replace(
            self,
            channels={new: c.values for new, c in chosen.items()},
            units={new: c.unit for new, c in chosen.items()},
            meta=meta,
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
        channels = {k: v[part] for k, v in self.channels.items()}
        return replace(self, time=self.time[part], channels=channels)

    def unwrap(self, name: str, period: float) -> Recording:
        """Return the recording with a channel that does not begin anew after each turn.

        Parameters
        ----------
        name : str
            Channel of an encoder that wraps.
        period : float
            One turn, in the unit of the channel (SI once read).

        Raises
        ------
        UnusableInput
            There is no such channel, or the period is no positive number.
        """
        if not (isinstance(period, int | float) and np.isfinite(period) and period > 0):
            raise UnusableInput(f"{self.name}: period {period!r} of {name}; give one turn, above 0")
        straight = unwrapped(self[name], period)
        note = f"{name}: jumps by {period:g} undone"
        meta = {**self.meta, "notes": (*self.notes, note)}
        return replace(self, channels={**self.channels, name: straight}, meta=meta)

    def decimate(self, factor: int, unfiltered: Collection[str] = ()) -> Recording:
        """Keep every `factor`-th sample after a zero-phase low-pass that prevents aliasing.

        All channels pass the same symmetric filter (see `bondgraph.signals.decimation`), so a
        linear relation between them survives.

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
        channels = {
            c: v[::factor] if c in unfiltered else thinned(v, factor)
            for c, v in self.channels.items()
        }
        note = f"decimated by {factor} with a zero-phase low-pass"
        meta = {**self.meta, "notes": (*self.notes, note)}
        if isinstance(known := meta.get("noise"), Mapping):  # the low-pass takes a part of it away
            meta["noise"] = {n: v for n, v in known.items() if n in unfiltered}
        return replace(self, time=self.time[::factor], channels=channels, meta=meta)

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
        return write_csv(self, Path(path))

    def plot(self) -> Panels:
        """Draw the channels over time; returns matplotlib axes, one a channel."""
        from bondgraph.drawing.courses import courses

        return courses(self.time, self.channels, self.units)

    def to_pandas(self) -> Any:
        """Return a pandas DataFrame: index `t_s`, columns `name[unit]`."""
        return to_pandas(self)

    @classmethod
    @spelled
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
        return to_xarray(self)

    @classmethod
    @spelled
    def from_xarray(
        cls,
        data: Any,
        name: str | None = None,
        *,
        map: Mapping[str, str] | None = None,
        fs: float | None = None,
    ) -> Recording:
        """Make a recording from a Dataset or a DataArray.

        Parameters
        ----------
        data : xarray.Dataset or xarray.DataArray
            Variables over one dimension, with attribute `units` or `unit`, or the unit in the
            name; its coordinate is the time, of a calendar or in the unit of its attribute (s).
        name : str, optional
            Name of the recording; that of the data if not given.
        map, fs
            As in `read`.

        Returns
        -------
        Recording
            SI values; source, SHA-256 and notes are those that `to_xarray` stored.

        Raises
        ------
        UnusableInput
            As in `read`, or if a variable has more than one dimension.
        """
        table, kept = dataset_arrays(data, name)
        called = str(kept.pop("name"))
        read = cls.from_arrays(called, table, map=map, fs=fs)
        notes = (*kept.pop("notes", ()), *read.notes)
        return replace(read, meta={**read.meta, "notes": notes}, **kept)

    def __repr__(self) -> str:
        """Return name, size, rate and channels in one line."""
        rate = f", {self.fs:.6g} Hz" if self.n > 1 else ""
        names = ", ".join(f"{k} [{u}]" for k, u in self.units.items())
        return f"Recording({self.name!r}, {self.n} samples{rate}: {names})"

    def _repr_html_(self) -> str:
        """Return a table of the channels for notebooks."""
        return to_html(self)


def _origin(even: Even) -> dict[str, Any]:
    """Return what `meta` keeps of reading: sentences, and units that were converted."""
    more = {"read_in": even.read_in, "left_out": even.left_out}
    return {"notes": even.notes} | {k: v for k, v in more.items() if v}
