"""Which column becomes which channel, which one the time, which one the sampling rate."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bondgraph.signals.files.checks import check_name, map_argument, means_time
from bondgraph.signals.units import (
    GRAM,
    GRAVITY,
    Unit,
    meant_by,
    parse_unit,
    read_unit,
    same_dimension,
    split_header,
)
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnknownName, UnusableInput, unknown_name

OTHERS = "*"
"""Key of a map for all other columns: `"*"` asks for them, an empty text leaves them out."""


class NoUnit(UnusableInput):
    """A column whose header names no unit.

    Parameters
    ----------
    where : str
        The file.
    column : str
        The header.
    beside : sequence of str
        Headers of the other columns, where they are known.
    """

    def __init__(self, where: str, column: str, beside: Sequence[str] = ()) -> None:
        super().__init__(where, column)
        self.where, self.column, self.beside = where, column, tuple(beside)

    def __str__(self) -> str:
        """Return the line, with a map entry under the column's own name."""
        return self.said(self.column)

    def said(self, name: str, unit: str = "") -> str:
        """Return the line, with a map entry of a channel and its unit."""
        entry = map_argument(name, f"{self.column}[{self.likely(unit)}]")
        return f"{self.lack(unit)} ('1' for a pure number), or say it with {entry}"

    def lack(self, unit: str) -> str:
        """Return what is missing, and how it is written into the header."""
        base, _, tail = self.column.rpartition("_")
        close = meant_by(tail, unit) if base else ()
        if not close:
            return (
                f"{self.where}, column {self.column!r}: no unit; write it behind the name, such as "
                f"'{self.column}[{self.likely(unit)}]'"
            )
        return (
            f"{self.where}, column {self.column!r}: no unit that is known ({tail} is none; "
            f"{' or '.join(close)} meant?); write it behind the name, such as "
            f"'{base}[{self.likely(unit)}]'"
        )

    def likely(self, unit: str) -> str:
        """Return what a misspelled unit may be, of the dimension of `unit` if that is known."""
        close = meant_by(self.column.rpartition("_")[2], unit)
        return next((k for k in close if same_dimension(k, unit or k)), unit or "N")


class TurnedRound(UnknownName):
    """A map names no column, but its name is one: it may stand the other way round.

    Parameters
    ----------
    error : UnknownName
        What is said of the column.
    name, target : str
        The entry of the map.
    """

    def __init__(self, error: UnknownName, name: str, target: str) -> None:
        super().__init__(str(error), name, target)
        self.error, self.name, self.target = error, name, target

    def __str__(self) -> str:
        """Return the line, with the entry turned round."""
        return (
            f"{self.error}; or, as {self.name} is one of them, turn it round, "
            f"{map_argument(self.target, self.name)}"
        )


@dataclass(frozen=True, slots=True)
class ColumnPlan:
    """Which column becomes what: channel -> (header, unit), time and rate columns."""

    channels: dict[str, tuple[str, Unit]]
    time: tuple[str, Unit] | None
    rate: str | None
    left_out: tuple[str, ...] = ()
    """Columns without a unit that a map does not name."""
    unused: tuple[str, ...] = ()
    """Times that a rate stands for."""

    @property
    def headers(self) -> list[str]:
        """All columns that must be read."""
        picked = [h for h, _ in self.channels.values()]
        picked += [self.time[0]] if self.time else []
        return list(dict.fromkeys(picked + ([self.rate] if self.rate else [])))


@dataclass(frozen=True, slots=True)
class ColumnTable:
    """Columns as read, before units, with the place of every sample for messages.

    A place ends with its number, such as ``row 12``. `texts` are the first cells that hold a word
    in place of a number, by header and place.
    """

    plan: ColumnPlan
    columns: dict[str, FloatArray]
    place: Callable[[int], str]
    notes: tuple[str, ...] = ()
    texts: Mapping[tuple[str, str], str] = field(default_factory=dict)

    def kept(self, first: int | None, last: int | None, where: str) -> ColumnTable:
        """Return the rows with numbers from `first` to `last`, both among them.

        Raises
        ------
        UnusableInput
            None is left.
        """
        n = next(iter(self.columns.values())).size

        def number(i: int) -> int:
            return int(self.place(i).rpartition(" ")[2])

        begin = 0 if first is None else bisect_left(range(n), first, key=number)
        end = n if last is None else bisect_right(range(n), last, key=number)
        if begin >= end:
            raise UnusableInput(
                f"{where}: no row from {first} to {last}; there are {self.place(0)} to "
                f"{self.place(n - 1)}"
            )
        columns = {h: v[begin:end] for h, v in self.columns.items()}
        note = f"{self.place(begin)} to {self.place(end - 1)} only"
        return replace(
            self, columns=columns, place=lambda i: self.place(begin + i), notes=(*self.notes, note)
        )


def is_time(header: str) -> bool:
    """Whether a column is the time: called so, and in a unit of time if it has one."""
    base, unit = split_header(header)
    if not means_time(base):
        return False
    return unit is None or parse_unit(unit, header).dims == (0, 0, 1, 0, 0)


def is_stamp(header: str) -> bool:
    """Whether a column is a logger's time stamp: the time where no column is called so."""
    base, unit = split_header(header)
    called = "".join(c for c in base.lower() if c.isalpha())
    if called not in ("timestamp", "datetime"):
        return False
    return unit is None or parse_unit(unit, header).dims == (0, 0, 1, 0, 0)


def is_rate(header: str) -> bool:
    """Whether a column is the sampling rate."""
    return _before_rate(header) is not None


def _before_rate(header: str) -> str | None:
    """Return how the names begin that a sampling rate is for; None if a column is none."""
    low = header.lower()
    if low == "fs[hz]":
        return ""
    return header[: -len("fs_hz")] if low.endswith("fs_hz") else None


def _unit_of(header: str, where: str, beside: Sequence[str] = ()) -> Unit:
    base, unit = split_header(header)
    if unit is None:
        raise NoUnit(where, header, [h for h in beside if h != header])
    if unit in ("C", "F") and "temp" in base.lower():
        means = {"C": "coulomb", "F": "farad"}[unit]
        raise UnusableInput(f"{where}, column {header!r}: {unit} means {means}; write degC or K")
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
        if (split_header(matches[0])[1] or "", tail) == (GRAM, GRAVITY):
            return matches[0], given
        if given.dims != unit.dims or not np.isclose(given.scale, unit.scale, rtol=1e-12, atol=0):
            raise UnusableInput(
                f"{where}: the map says {target!r} but the header says {matches[0]!r}; "
                f"make the units agree"
            )
    return matches[0], unit


def _asked(name: str, target: str, headers: Sequence[str], where: str) -> tuple[str, Unit]:
    """Return the column of an entry of the map; what stands the other way round is said so."""
    try:
        return _find(target, headers, where)
    except UnknownName as error:
        turned = [h for h in headers if name in (h, split_header(h)[0])]
        if not turned:
            raise
        raise TurnedRound(error, name, target.strip()) from None


def choose(
    headers: Sequence[str], map: Mapping[str, str] | None, fs: float | None, where: str
) -> ColumnPlan:
    """Decide which columns are the channels, the time and the sampling rate."""
    seen: set[str] = set()
    for h in headers:
        if h and h in seen:
            raise UnusableInput(f"{where}: two columns are called {h!r}; rename one")
        seen.add(h)
    named = [h for h in headers if h]
    rates = [h for h in named if is_rate(h)]
    stamps = [h for h in named if is_stamp(h)]
    times = [h for h in named if is_time(h)] or stamps
    asked = {k: v for k, v in (map or {}).items() if not means_time(k) and k != OTHERS}
    time_asked = [v for k, v in (map or {}).items() if means_time(k)]
    channels = {k: _asked(k, v, named, where) for k, v in asked.items()}
    lacking: list[str] = []
    if named and fs is None and not (times or rates or time_asked):
        raise _no_time(named, where)  # first: what is no channel needs no unit of a quantity
    if map is None or map.get(OTHERS):
        taken = {*rates, *times, *stamps, *(h for h, _ in channels.values())}
        if time_asked and fs is None:
            taken.add(_find_time(time_asked[0], named, where)[0])
        free = [h for h in named if h not in taken]
        if map is not None:  # who names columns has said which ones count
            lacking = [h for h in free if split_header(h)[1] is None]
            free = [h for h in free if h not in lacking]
        others = _by_base(free, where)
        channels |= {k: v for k, v in others.items() if k not in channels}
    for name in channels:
        check_name(name, where)
    if not channels:
        raise UnusableInput(f"{where}: no column holds a channel; columns: {', '.join(named)}")
    if fs is not None:
        return ColumnPlan(channels, None, None, tuple(lacking), tuple(times))
    if time_asked:
        clock = _find_time(time_asked[0], named, where)
        return ColumnPlan(channels, clock, None, tuple(lacking))
    if len(times) > 1:
        raise UnusableInput(
            f"{where}: columns {', '.join(times)} could all be the time",
            remedies=["choose with map={'t': COLUMN}"],
        )
    if times:
        unit = split_header(times[0])[1]
        return ColumnPlan(
            channels, (times[0], parse_unit(unit or "s", f"{where}, {times[0]}")), None,
            tuple(lacking),
        )  # fmt: skip
    chosen = [h for h, _ in channels.values()]
    fitting = [r for r in rates if all(h.startswith(_before_rate(r) or "") for h in chosen)]
    if not fitting:
        raise _no_time(named, where)
    return ColumnPlan(channels, None, max(fitting, key=len), tuple(lacking))


def _no_time(named: Sequence[str], where: str) -> UnusableInput:
    return UnusableInput(
        f"{where}: no time column (columns: {', '.join(named)})",
        remedies=[
            f"name the column of the time, such as {map_argument('t', _clock(named))}",
            "add a column 't_s' or 'fs_hz'",
            "give the sampling rate, fs=HZ",
        ],
    )


def _clock(headers: Sequence[str]) -> str:
    """Return the column that is the time as likely as any, with a unit: mostly the first one."""
    base, unit = split_header(headers[0])
    timed = unit is None or (known := read_unit(unit)) is None or known.dims == (0, 0, 1, 0, 0)
    return (f"{base}[{unit or 's'}]") if timed else "COLUMN[s]"


def _by_base(headers: Sequence[str], where: str) -> dict[str, tuple[str, Unit]]:
    """Return columns by their names without the unit."""
    found: dict[str, tuple[str, Unit]] = {}
    for h in headers:
        base = split_header(h)[0]
        if base in found:
            raise UnusableInput(
                f"{where}: columns {found[base][0]!r} and {h!r} would both be channel {base!r}",
                remedies=[f"choose with {map_argument(base, h)}"],
            )
        found[base] = (h, _unit_of(h, where, headers))
    return found


def _find_time(target: str, headers: Sequence[str], where: str) -> tuple[str, Unit]:
    """Return the column that a map gives to the time, and its unit: s if none is said."""
    base, unit = split_header(target)
    fits = [h for h in headers if target.strip() in (h, split_header(h)[0])]
    fits = fits or [h for h in headers if base in (h, split_header(h)[0])]
    if not fits:
        raise unknown_name("time column", target, where, headers)
    own = split_header(fits[0])[1]
    found = parse_unit(own or unit or "s", f"{where}, {fits[0]}")
    if found.dims != (0, 0, 1, 0, 0):
        raise UnusableInput(f"{where}: the time column {fits[0]!r} is not in a unit of time")
    if own and unit and parse_unit(unit, f"{where}, map to {target!r}").scale != found.scale:
        raise UnusableInput(
            f"{where}: the map says {target!r} but the header says {fits[0]!r}; "
            "make the units agree"
        )
    return fits[0], found
