"""Text tables: encoding, separator, decimal sign, rows of numbers."""

from __future__ import annotations

import csv
from array import array
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bondgraph.signals.files.columns import ColumnPlan, ColumnTable, choose
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


def read_csv(file: Path, map: Mapping[str, str] | None, fs: float | None) -> ColumnTable:
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
    return ColumnTable(plan, columns, lambda i: f"row {lines[i]}", tuple(notes))


def _blank(cell: str) -> float:
    if cell.strip():
        raise ValueError(cell)
    return float("nan")
