"""One even time base, values in SI."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.signals.files.checks import SHORT, check_finite, means_time, require_map
from bondgraph.signals.files.columns import OTHERS, ColumnPlan, ColumnTable
from bondgraph.signals.files.filling import MILD, filled, is_filled, rows_left_out
from bondgraph.signals.files.placeholders import as_missing, notes_on_outliers, refuse_placeholders
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, real_number

TIME = "time"
"""Name of the time among units as read; no channel may be called so."""
_EVEN = 0.01
_FINEST = 10.0
"""Largest ratio of a resampled rate to the recorded one: more adds rows, not knowledge."""


@dataclass(frozen=True, slots=True)
class Even:
    """Channels in SI on one even time base, with what was done to get there."""

    time: FloatArray
    channels: dict[str, FloatArray]
    units: dict[str, str]
    notes: tuple[str, ...]
    read_in: dict[str, str]
    """Units as they were read, by channel and `TIME`; those that are SI are left out."""
    left_out: str = ""
    """Which columns a map that does not name them has left out, and why."""

    def without(self, why: str) -> Even:
        """Return it with a note on columns that are left out."""
        return replace(self, left_out=why, notes=(*self.notes, why)) if why else self


def with_others(
    read: Callable[[Mapping[str, str] | None], Even], map: Mapping[str, str] | None
) -> Even:
    """Read the columns of a map, and all others where they can be read."""
    require_map(map)
    if map is None or OTHERS in map:
        return read(map)
    try:
        return read({**map, OTHERS: OTHERS})
    except UnusableInput as error:
        if all(means_time(n) for n in map):
            raise
        named = read(map)
        return named.without(f"only the columns of the map are read: {UnusableInput(*error.args)}")


def texts_of(table: ColumnTable, header: str) -> dict[str, str]:
    """Return the words that stand in place of numbers in one column, by place."""
    return {place: text for (column, place), text in table.texts.items() if column == header}


def make_even(
    table: ColumnTable, where: str, fs: float | None, onto: float | None = None, fill: int = 0
) -> Even:
    """Check values, make the time even (at `onto` samples a second), convert to SI.

    Up to `fill` missing samples in a row are filled in before; numbers that stand for no value are
    missing then, and else refused.
    """
    most = real_number(f"{where}: fill", fill)
    if most < 0.0 or most != int(most):
        raise UnusableInput(f"{where}: fill = {fill!r}; give how many missing samples in a row")
    if most:
        table = filled(as_missing(table), int(most))
    else:
        refuse_placeholders(table, where)
    table = replace(table, notes=(*table.notes, *notes_on_outliers(table)))
    plan, notes = table.plan, list(table.notes)
    for header, values in table.columns.items():
        fills = is_filled(table, header)
        what = f"{where}, column {header!r}"
        check_finite(values, what, table.place, fills=fills, texts=texts_of(table, header))
    channels = {k: unit.to_si(table.columns[h]) for k, (h, unit) in plan.channels.items()}
    units = {k: unit.si for k, (_, unit) in plan.channels.items()}
    notes += [f"channel {k!r}: {u.note}" for k, (_, u) in plan.channels.items() if u.note]
    n = next(iter(channels.values())).size
    if plan.time is not None:
        stamps = plan.time[1].to_si(table.columns[plan.time[0]])
        column = f"{where}, column {plan.time[0]!r}"
        time, note = even_time(stamps, column, table.place, onto)
        if note:
            channels = {k: np.interp(time, stamps, v) for k, v in channels.items()}
            notes.append(note)
    else:
        if onto is not None:
            raise UnusableInput(f"{where}: there are no time stamps to resample by; leave it out")
        rate = fs
        if rate is None and plan.rate is not None:
            rates = table.columns[plan.rate]
            if np.any(rates != rates[0]):
                raise UnusableInput(f"{where}, column {plan.rate!r}: the rate changes; give t_s")
            rate = float(rates[0])
        if rate is None or not (np.isfinite(rate) and rate > 0.0):
            raise UnusableInput(f"{where}: the sampling rate must be positive, not {rate!r} Hz")
        time = np.arange(n) / rate
        if fs is not None and plan.unused:
            unused = ", ".join(map(repr, plan.unused))
            notes.append(f"the time in {unused} is not used: the rate is given, {rate:.6g} Hz")
    even = Even(time, channels, units, tuple(notes), _read_in(plan))
    return even.without(_lacking(plan.left_out))


def _lacking(columns: Sequence[str]) -> str:
    """Say which columns without a unit are left out."""
    if not columns:
        return ""
    shown = f"{', '.join(map(repr, columns[:4]))}{', ...' if len(columns) > 4 else ''}"
    return f"without a unit, so left out: {shown}"


def _read_in(plan: ColumnPlan) -> dict[str, str]:
    known = {k: unit for k, (_, unit) in plan.channels.items()}
    known |= {} if plan.time is None else {TIME: plan.time[1]}
    # numbers in degC are those of the file, but they are no absolute temperatures
    return {k: str(unit) for k, unit in known.items() if not unit.is_si or unit.note}


def even_time(
    t: FloatArray, where: str, place: Callable[[int], str], onto: float | None = None
) -> tuple[FloatArray, str]:
    """Return the time, put on an even grid if mildly uneven, and a note if that was done.

    With `onto`, samples a second, it is put on that grid however uneven it is.
    """
    if t.size < 2:
        return t, ""
    steps = np.diff(t)
    wrong = np.flatnonzero(steps <= 0.0)
    if wrong.size:
        i = int(wrong[0]) + 1
        if np.ptp(t) == 0.0:
            raise UnusableInput(
                f"{where}: all {t.size} time stamps are {t[0]:.9g} s",
                remedies=["give the sampling rate, fs=HZ", "a column that counts the time"],
            )
        what = "repeats the one before" if steps[i - 1] == 0.0 else "is earlier than the one before"
        raise UnusableInput(
            f"{where}, {place(i)}: the time stamp {t[i]:.9g} s {what} ({wrong.size} such rows); "
            f"sort the rows and remove duplicates"
        )
    mean = (t[-1] - t[0]) / (t.size - 1)
    typical = float(np.median(steps))
    if onto is not None:
        if not 0.5 / typical <= onto < np.inf:
            raise UnusableInput(
                f"{where}: resampling onto {onto:.6g} Hz would fold what {1 / typical:.6g} samples "
                "a second hold; give half of it or more"
            )
        if onto * typical > _FINEST * (1.0 + 1e-9):
            raise UnusableInput(
                f"{where}: resampling onto {onto:.6g} Hz is more than {_FINEST:g} times the "
                f"recorded {1 / typical:.6g} Hz and adds rows without knowledge",
                remedies=[f"give the recorded rate (resample={1 / typical:.6g})"],
            )
        note = (
            f"resampled by linear interpolation onto {onto:.9g} Hz; the widest step was "
            f"{steps.max():.6g} s, the usual {typical:.6g} s"
        )
        return t[0] + np.arange(int((t[-1] - t[0]) * onto * (1 + 1e-12)) + 1) / onto, note
    worst = int(np.argmax(np.abs(steps - typical)))
    jitter = float(abs(steps[worst] - typical) / typical)
    if jitter <= _EVEN:
        return t, ""
    if jitter < MILD:
        note = (
            f"uneven time (up to {100 * jitter:.2g} % of the step): resampled by linear "
            f"interpolation onto {mean:.9g} s"
        )
        return np.linspace(t[0], t[-1], t.size), note
    raise UnusableInput(
        f"{where}, {place(worst + 1)}: uneven time, a step of {steps[worst]:.6g} s where "
        f"{typical:.6g} s is usual",
        remedies=[
            *_lines_across(t),
            f"resample evenly (resample={1 / typical:.6g})",
            "keep the rows on one side of a gap (rows=(FIRST, LAST))",
            "give the sampling rate (fs=HZ) if the stamps are only rounded",
        ],
    )


def _lines_across(t: FloatArray) -> list[str]:
    """Propose to fill what is left out of an otherwise even course, where that is little."""
    left_out, even = rows_left_out(t)
    most = int(left_out.max())
    if not (even and 1 <= most <= SHORT):
        return []
    return [f"draw straight lines across the samples that were left out (fill={most})"]
