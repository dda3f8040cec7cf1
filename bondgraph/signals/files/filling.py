"""Missing samples, filled in by straight lines where a user asks for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.columns import ColumnTable
from bondgraph.support.arrays import FloatArray

MILD = 0.20
"""Share of the usual step by which a stamp may be off its place."""


def filled(table: ColumnTable, most: int) -> ColumnTable:
    """Return the table with up to `most` missing samples in a row filled in, and a note of it.

    Missing is what is empty or NaN, and rows that are left out of an otherwise even time. Longer
    gaps, infinite values and gaps at an end stay: they are refused like all others.
    """
    clock = table.plan.time[0] if table.plan.time else None
    if clock is not None and _rises(table.columns[clock]):
        table = _with_rows(table, clock, most)
    columns = dict(table.columns)
    counts: dict[str, int] = {}
    first: list[int] = []
    for header, values in table.columns.items():
        if not (is_filled(table, header) and np.isnan(values).any()):
            continue
        at = table.columns[clock] if clock is not None else np.arange(values.size, dtype=float)
        columns[header] = _bridged(at, values, most)
        if (changed := np.flatnonzero(np.isnan(values) & ~np.isnan(columns[header]))).size:
            counts[header] = changed.size
            first.append(int(changed[0]))
    if not counts:
        return table
    each = ", ".join(f"{n} of {header!r}" for header, n in counts.items())
    note = (
        f"missing samples were filled by straight lines, at most {most} in a row: {each}; the "
        f"first beside {table.place(min(first))}"
    )
    return replace(table, columns=columns, notes=(*table.notes, note))


def is_filled(table: ColumnTable, header: str) -> bool:
    """Whether values of a column are filled in: of a channel, on a time that can be trusted."""
    clock = table.plan.time[0] if table.plan.time else None
    if header in (clock, table.plan.rate):
        return False
    return clock is None or _rises(table.columns[clock])


def rows_left_out(stamps: FloatArray) -> tuple[NDArray[np.int64], bool]:
    """Return how many rows are left out behind each but the last, and whether all others fit."""
    steps = np.diff(stamps)
    typical = float(np.median(steps))
    count = np.rint(steps / typical)
    near = np.abs(steps - count * typical) < MILD * typical
    left_out = np.where(near & (count > 1), count - 1, 0)
    return left_out.astype(np.int64), bool((near & (count > 0)).all())


def _rises(stamps: FloatArray) -> bool:
    return bool(np.isfinite(stamps).all() and (np.diff(stamps) > 0).all())


def _with_rows(table: ColumnTable, clock: str, most: int) -> ColumnTable:
    """Return the table with rows of nothing where up to `most` stamps are left out."""
    stamps = table.columns[clock]
    if stamps.size < 3:
        return table
    left_out = rows_left_out(stamps)[0]
    left_out = np.where(left_out <= most, left_out, 0)
    if not left_out.any():
        return table
    row = np.repeat(np.arange(stamps.size), 1 + np.append(left_out, 0))
    new = np.concatenate([[False], row[1:] == row[:-1]])
    columns = {h: np.where(new, np.nan, v[row]) for h, v in table.columns.items()}
    columns[clock] = np.interp(np.arange(row.size), np.flatnonzero(~new), stamps)
    return replace(table, columns=columns, place=lambda i: table.place(int(row[i])))


def _bridged(at: FloatArray, values: FloatArray, most: int) -> FloatArray:
    missing = np.isnan(values)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], missing, [False])).astype(np.int8)))
    made = values.copy()
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        if b - a <= most and a > 0 and b < values.size and np.isfinite(values[[a - 1, b]]).all():
            made[a:b] = np.interp(at[a:b], at[[a - 1, b]], values[[a - 1, b]])
    return made
