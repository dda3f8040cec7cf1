"""Channels in files that hold groups: which lie on one time base, and which were meant."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.arrays import pick_arrays
from bondgraph.signals.files.checks import check_total, map_argument, means_time
from bondgraph.signals.files.columns import OTHERS, ColumnTable, is_rate, is_time
from bondgraph.signals.units import parse_unit, split_header
from bondgraph.support.errors import UnusableInput, unknown_name

_TIME = "t[s]"
_SHOWN = 8


@dataclass(frozen=True, slots=True)
class StoredArray:
    """One array of a file, not read yet.

    Parameters
    ----------
    path : str
        Its name with the groups around it: `group/x`.
    shape : tuple of int
        After removal of axes of length one.
    read : callable
        Returns the values.
    unit : str
        Unit from an attribute; empty if there is none. It may stand in the name as well.
    start, step : float, float or None
        First time and time step, s, where the file states them.
    refusal : str
        What it is, if no channel can be made of it: `a cell`.
    """

    path: str
    shape: tuple[int, ...]
    read: Callable[[], NDArray[Any]]
    unit: str = ""
    start: float = 0.0
    step: float | None = None
    refusal: str = ""

    def header(self, where: str) -> str:
        """Path with its unit, as a column would be headed."""
        own = split_header(self.path)[1]
        try:
            unit = parse_unit(self.unit, where) if self.unit else None
        except UnusableInput:
            unit = None
        if unit is None:
            return self.path
        try:
            named = parse_unit(own, where) if own is not None else None
        except UnusableInput:
            named = None
        if named is None or named.dims != unit.dims:
            # the tail of `phase_A` in volts is no unit
            return f"{_stem(self.path)}[{self.unit}]"
        if not np.isclose(named.scale, unit.scale, rtol=1e-12, atol=0):
            raise UnusableInput(
                f"{where}: {self.path!r} has the attribute unit {self.unit!r}; make the units agree"
            )
        return self.path


def pick_stored(
    found: Sequence[StoredArray],
    map: Mapping[str, str] | None,
    fs: float | None,
    where: str,
    separator: str = "/",
) -> ColumnTable:
    """Read the arrays that a plan needs, with the time base that belongs to them.

    Raises
    ------
    UnusableInput, UnknownName
        Nothing fits, several fit, or the channels lie on several time bases.
    """
    if not any(not s.refusal for s in found):
        said = "; ".join(f"{s.path!r} is {s.refusal}" for s in found[:_SHOWN])
        raise UnusableInput(
            f"{where}: holds no array of numbers{' (' + said + ')' if said else ''}; "
            "store one array per channel"
        )
    table = {s.path: s for s in found}
    plan: dict[str, str] | None = None
    asked: list[StoredArray] = []
    timing: StoredArray | None = None
    if map is not None:
        plan = {}
        for name, target in map.items():
            if name == OTHERS:
                plan[name] = target
                continue
            stored, tail = _resolve(target, table, where, separator)
            if means_time(name):
                timing = replace(stored, unit=stored.unit or tail[1:-1])
                continue
            asked.append(stored)
            plan[name] = _stem(stored.path) + tail if tail else stored.header(where)
    if map is None or map.get(OTHERS):
        at = timing.path if timing else ""
        asked += [
            s for s in found
            if not s.refusal and s.shape and not _is_base(s, separator) and s.path != at
        ]  # fmt: skip
    asked = list(dict.fromkeys(asked))
    bases = _bases(asked, found, timing, fs, where, separator)
    _check_one(bases, where)
    check_total(sum(int(np.prod(s.shape)) * 8 for s in asked), where)
    arrays = {s.header(where): _values(s) for s in asked}
    base = next(iter(bases.values()), None)
    if fs is None and isinstance(base, StoredArray):
        arrays[_time_header(base, where, separator)] = _values(base)
    elif fs is None and isinstance(base, tuple):
        start, step = base
        arrays[_TIME] = start + step * np.arange(next(iter(arrays.values())).size)
    return pick_arrays(arrays, plan, fs, where)


_Base = StoredArray | tuple[float, float] | None


def _stem(path: str) -> str:
    """Path without a unit in brackets."""
    return split_header(path)[0] if path.endswith(("]", ")")) else path


def _values(stored: StoredArray) -> NDArray[Any]:
    return stored.read().reshape(stored.shape)


def _group(path: str, separator: str) -> str:
    return path.rpartition(separator)[0]


def _last(path: str, separator: str) -> str:
    return path.rpartition(separator)[2]


def _is_base(stored: StoredArray, separator: str) -> bool:
    """Whether it is a time or a sampling rate."""
    last = _last(stored.path, separator)
    return is_rate(last) or is_time(last)


def _time_header(base: StoredArray, where: str, separator: str) -> str:
    last = _last(base.path, separator)
    if is_rate(last):
        return "fs_hz"
    unit = split_header(replace(base, path=last).header(where))[1]
    return f"t[{unit or 's'}]"


def _resolve(
    target: str, table: Mapping[str, StoredArray], where: str, separator: str
) -> tuple[StoredArray, str]:
    """Return the array a map entry means, and the unit in brackets it adds."""
    target = target.strip()
    wanted = target.replace("/", separator) if target not in table else target
    base, _, tail = wanted[:-1].partition("[") if wanted.endswith("]") else (wanted, "", "")
    base = base.strip()
    for text, unit in ((wanted, ""), (base, tail)):
        for whole in (True, False):
            fits = [p for p in table if _means(text, p, whole, separator)]
            if len(fits) > 1:
                raise UnusableInput(
                    f"{where}: {target!r} fits {', '.join(fits[:_SHOWN])}; give the full name"
                )
            if fits:
                stored = table[fits[0]]
                if stored.refusal:
                    raise UnusableInput(
                        f"{where}: {stored.path!r} is {stored.refusal}; store plain number arrays"
                    )
                return stored, f"[{unit}]" if unit else ""
    raise unknown_name("array", target, where, [p for p, s in table.items() if not s.refusal])


def _means(text: str, path: str, whole: bool, separator: str) -> bool:
    """Whether a text names a path, or its last parts; the unit may be left out."""
    forms = (path, split_header(path)[0])
    return text in forms if whole else any(f.endswith(separator + text) for f in forms)


def _bases(
    asked: Sequence[StoredArray],
    found: Sequence[StoredArray],
    timing: StoredArray | None,
    fs: float | None,
    where: str,
    separator: str,
) -> dict[StoredArray, _Base]:
    """Time base of every channel: the time array nearest in the groups, or start and step."""
    if fs is not None:
        return dict.fromkeys(asked)
    if timing is not None:
        return dict.fromkeys(asked, timing)
    usable = [s for s in found if not s.refusal]
    times = [s for s in usable if is_time(_last(s.path, separator)) and s.shape]
    rates = [s for s in usable if is_rate(_last(s.path, separator))]
    return {s: _base(s, times, rates, where, separator) for s in asked}


def _base(
    stored: StoredArray,
    times: Sequence[StoredArray],
    rates: Sequence[StoredArray],
    where: str,
    separator: str,
) -> _Base:
    for kind, step in ((times, None), ((), stored.step), (rates, None)):
        if step is not None:
            return (stored.start, step)
        near = [t for t in kind if _holds(_group(t.path, separator), stored.path, separator)]
        longest = max((len(_group(t.path, separator)) for t in near), default=0)
        best = [t for t in near if len(_group(t.path, separator)) == longest]
        if len(best) > 1:
            raise UnusableInput(
                f"{where}: {', '.join(t.path for t in best)} could all be the time",
                remedies=["choose with map={'t': COLUMN}"],
            )
        if best:
            return best[0]
    return None


def _holds(group: str, path: str, separator: str) -> bool:
    return not group or path.startswith(group + separator)


def _check_one(bases: Mapping[StoredArray, _Base], where: str) -> None:
    """Refuse channels of several lengths or time bases; name the choices."""
    kinds: dict[tuple[Any, ...], list[str]] = {}
    for stored, base in bases.items():
        key = base.path if isinstance(base, StoredArray) else base
        kinds.setdefault((stored.shape, key), []).append(stored.path)
    if len(kinds) < 2:
        return
    said = []
    for (shape, base), paths in list(kinds.items())[:_SHOWN]:
        size = " x ".join(str(n) for n in shape) or "1"
        over = f" over {base}" if isinstance(base, str) else ""
        if isinstance(base, tuple):
            over = f" every {base[1]:.6g} s from {base[0]:.6g} s"
        more = ", ..." if len(paths) > 4 else ""
        said.append(f"{', '.join(paths[:4])}{more} ({size} samples{over})")
    pick = next(iter(kinds.values()))[0]
    raise UnusableInput(
        f"{where}: the channels lie on {len(kinds)} time bases: {'; '.join(said)}; choose those of "
        f"one with {map_argument('x', pick)}"
    )
