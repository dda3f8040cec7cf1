"""Numbers that stand for no value, such as -9999, and single values far outside all others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.signals.files.columns import ColumnTable
from bondgraph.signals.files.filling import is_filled
from bondgraph.support.arrays import Array, FloatArray
from bondgraph.support.errors import UnusableInput

_WRITTEN = (999.0, 999.25, 9999.0, 99999.0, 999999.0, 32767.0, 32768.0, 65535.0, 1e20, 1e30, 1e38)
"""What loggers write where they have no value; with both signs."""
_APART = 10.0
"""Ranges of all other values by which such a number is apart from them."""
_FAR = 20.0
"""The same of a single value that no logger is known to write."""
_SHARE = 0.1
"""Share of a column up to which a number stands for no value; more of it is what was measured."""
_MOST = 6
"""Rows that a line names."""
FAR_OUTSIDE = "single values far outside all others: "
"""Begin of the note on them."""


def as_missing(table: ColumnTable) -> ColumnTable:
    """Return the table with nothing where a number stands for no value."""
    columns, texts = dict(table.columns), dict(table.texts)
    for header, values in table.columns.items():
        rows = _placeholders(_channel(table, header))
        if not rows.size:
            continue
        columns[header] = values.copy()
        columns[header][rows] = np.nan
        texts |= {(header, table.place(int(i))): f"{values[i]:.9g}" for i in rows}
    return replace(table, columns=columns, texts=texts)


def refuse_placeholders(table: ColumnTable, where: str) -> None:
    """Refuse numbers that stand for no value.

    Raises
    ------
    UnusableInput
        One line with the column, the rows, and how they are left out.
    """
    for header, values in table.columns.items():
        rows = _placeholders(_channel(table, header))
        if not rows.size:
            continue
        rest = np.delete(values, rows)
        said = " and ".join(f"{v:.9g}" for v in dict.fromkeys(values[rows]))
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        lines = [f"draw straight lines across (fill={max(map(len, runs))})"]
        lines = lines if is_filled(table, header) else []
        raise UnusableInput(
            f"{where}, column {header!r}: {said} in {_named(table, rows)}, far outside all other "
            f"values ({np.nanmin(rest):.6g} to {np.nanmax(rest):.6g}); loggers write that where "
            "they have no value",
            remedies=[*lines, "keep a part without any (rows=(FIRST, LAST))"],
        )


def notes_on_outliers(table: ColumnTable) -> tuple[str, ...]:
    """Return a note that names single values far outside all others of their columns."""
    found = []
    for header, values in table.columns.items():
        rows = _outliers(_channel(table, header))
        if rows.size:
            shown = ", ".join(f"{values[i]:.6g}" for i in rows[:_MOST])
            found.append(f"{header!r} in {_named(table, rows)} ({shown})")
    if not found:
        return ()
    return (
        f"{FAR_OUTSIDE}{'; '.join(found)}: if the sensor has not given them, leave their cells "
        "empty and draw straight lines across (fill=1)",
    )


def _channel(table: ColumnTable, header: str) -> FloatArray:
    """Return the values of a column; none of the time or the rate."""
    clock = table.plan.time[0] if table.plan.time else None
    return table.columns[header][: 0 if header in (clock, table.plan.rate) else None]


def _named(table: ColumnTable, rows: Array) -> str:
    word = table.place(int(rows[0])).rpartition(" ")[0]
    numbers = [table.place(int(i)).rpartition(" ")[2] for i in rows[:_MOST]]
    more = f" and {len(rows) - _MOST} more" if len(rows) > _MOST else ""
    return f"{word}{'s' if len(rows) > 1 else ''} {', '.join(numbers)}{more}"


def _placeholders(values: FloatArray) -> Array:
    """Return the rows of numbers that stand for no value."""
    known = np.isin(np.abs(values), _WRITTEN)
    rest = values[~known & np.isfinite(values)]
    if not known.any() or rest.size < 2 or known.sum() > _SHARE * values.size:
        return np.array([], int)
    low, high = float(rest.min()), float(rest.max())
    away = _APART * (high - low)
    return np.flatnonzero(known & ((values < low - away) | (values > high + away)) & (high > low))


def _outliers(values: FloatArray) -> Array:
    """Return the rows of the few values that lie far outside all others."""
    finite = np.sort(values[np.isfinite(values)])
    few = min(10, finite.size // 100)
    if not few:
        return np.array([], int)
    low, high = float(finite[few]), float(finite[-few - 1])
    away = _FAR * (high - low)
    return np.flatnonzero((high > low) & ((values < low - away) | (values > high + away)))
