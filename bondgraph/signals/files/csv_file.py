"""Text tables: encoding, separator, decimal sign, rows of numbers."""

from __future__ import annotations

import csv
from array import array
from collections.abc import Mapping
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from bondgraph.signals.files.columns import ColumnPlan, ColumnTable, choose
from bondgraph.signals.units import read_unit, split_header
from bondgraph.support.errors import UnusableInput


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


LONGEST_PREAMBLE = 200
"""Lines in which the names of the columns are looked for."""


def _delimiter(line: str) -> str:
    return max("\t;,", key=line.count) if any(d in line for d in "\t;") else ","


def _cells(line: str, delimiter: str) -> list[str]:
    return [c.strip() for c in next(csv.reader([line], delimiter=delimiter), [])]


def _header_line(lines: list[str]) -> int:
    """Return the line of the column names: the first without a number that numbers stand below.

    What instruments write above it is passed over. The first line that is no comment, where none
    is found.
    """
    told = [i for i, s in enumerate(lines) if s.strip() and not s.lstrip().startswith("#")]
    for at, i in enumerate(told):
        delimiter = _delimiter(lines[i])
        names = _cells(lines[i], delimiter)
        if any(map(_numeric, names)):
            continue
        units = _units_below(lines[i:], len(names), delimiter)
        below = told[at + 2 if units else at + 1 :][:1]
        if below and _are_numbers(_cells(lines[below[0]], delimiter), len(names)):
            return i
        if len(names) > 1 and all(read_unit(split_header(n)[1] or "") for n in names):
            return i  # names with units, and something wrong below
    return told[0] if told else len(lines)


def _units_below(lines: list[str], width: int, delimiter: str) -> list[str]:
    """Return the units of the columns, if the line below their names holds just these."""
    below = next((s for s in lines[1:] if s.strip()), "")
    cells = [c.removeprefix("(").removesuffix(")") for c in _cells(below, delimiter)]
    cells = [c.removeprefix("[").removesuffix("]") for c in cells]
    told = len(cells) == width and all(c == "" or read_unit(c) for c in cells)
    return cells if told and not any(map(_numeric, cells)) and any(cells) else []


def _are_numbers(cells: list[str], width: int) -> bool:
    told = [c for c in cells if c]
    return (
        min(2, width) <= len(cells) <= width
        and bool(told)
        and all(_numeric(c) or _stamp(c) for c in told)
    )


def _stamp(text: str) -> datetime | None:
    """Return a date with its time as ISO 8601 writes it; None if it is none."""
    try:
        found = datetime.fromisoformat(text.strip())
    except ValueError:
        return None
    return found if found.tzinfo else found.replace(tzinfo=UTC)


def read_csv(file: Path, map: Mapping[str, str] | None, fs: float | None) -> ColumnTable:
    """Read the needed columns of a text table."""
    encoding, where = _sniff(file), file.name
    try:
        with open(file, encoding=encoding, errors="replace", newline="") as stream:
            lines = list(islice(stream, LONGEST_PREAMBLE))
            skipped = _header_line(lines)
            delimiter = _delimiter(lines[skipped] if skipped < len(lines) else "")
            stream.seek(0)
            for _ in range(skipped):
                stream.readline()
            rows = csv.reader(stream, delimiter=delimiter)
            headers = [h.strip() for h in next(rows, [])]
            if units := _units_below(lines[skipped:], len(headers), delimiter):
                headers = [f"{h}[{u}]" if u else h for h, u in zip(headers, units, strict=True)]
                while not any(next(rows)):
                    pass
            if not any(headers):
                raise UnusableInput(f"{where}: there is no header line; name the columns in line 1")
            if all(_numeric(h) for h in headers if h):
                raise UnusableInput(
                    f"{where}, row {skipped + 1}: numbers where the column names should be; "
                    f"put a header line such as 't_s,x[um]' first, without '#'"
                )
            plan = choose(headers, map, fs, where)
            return _read_rows(rows, headers, plan, where, skipped, delimiter)
    except csv.Error as error:
        raise UnusableInput(f"{where}: not a table of numbers ({error}); export as CSV") from error
    except OSError as error:
        raise UnusableInput(f"{where}: cannot be read ({error.strerror})") from error


def _read_rows(
    rows: Any, headers: list[str], plan: ColumnPlan, where: str, skipped: int, delimiter: str
) -> ColumnTable:
    wanted = plan.headers
    index = [headers.index(h) for h in wanted]
    data = [array("d") for _ in wanted]
    lines = array("q")
    marks: set[str] = set()
    texts: dict[tuple[str, str], str] = {}
    clock = plan.time[0] if plan.time else None
    scale = plan.time[1].scale if plan.time else 1.0
    begin: datetime | None = None
    width, last = len(headers), max(index)
    for row in rows:
        line = skipped + rows.line_num
        if not any(row) or (len(row) == 1 and not row[0].strip()):
            continue
        if len(row) > width or len(row) <= last:
            hint = (
                "decimal commas need ';' between the columns"
                if delimiter == "," and width < len(row) <= 2 * width
                else "make every row as long as the header"
            )
            raise UnusableInput(
                f"{where}, row {line}: {len(row)} cells, the header has {width}; {hint}"
            )
        lines.append(line)
        for store, i, header in zip(data, index, wanted, strict=True):
            cell = row[i]
            if header == clock and not _numeric(cell) and (at := _stamp(cell)) is not None:
                begin = begin or at
                store.append((at - begin).total_seconds() / scale)
                continue
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
                if cell.strip().lower() in MISSING:
                    store.append(float("nan"))
                    if len(texts) < MOST_TEXTS:
                        texts[header, f"row {line}"] = cell.strip()
                    continue
                raise UnusableInput(
                    f"{where}, row {line}, column {header!r}: {row[i][:40]!r} is not a number; "
                    f"remove the row or correct the cell"
                ) from None
    if not lines:
        raise UnusableInput(f"{where}: there is a header but no row of numbers; export it again")
    columns = {h: np.frombuffer(d, dtype=np.float64) for h, d in zip(wanted, data, strict=True)}
    notes = ["decimal commas were read as decimal points"] if "," in marks else []
    if begin is not None:
        notes.append(f"time counts from {begin.isoformat()}")
    if "" in headers:
        notes.append("columns without a name were left out")
    return ColumnTable(plan, columns, lambda i: f"row {lines[i]}", tuple(notes), texts)


def _blank(cell: str) -> float:
    if cell.strip():
        raise ValueError(cell)
    return float("nan")


MISSING = ("#n/a", "n/a", "na", "null", "none", "-", "--")
"""What programs write into cells without a value, beside NaN and nothing."""
MOST_TEXTS = 1000
"""Such cells that are kept to be quoted."""
