"""JSON from strangers as plain data, within bounds of time and memory; nothing is executed."""

from __future__ import annotations

import json
import math
import stat
from pathlib import Path
from typing import Any, NoReturn

from bondgraph.support.errors import UnusableInput
from bondgraph.support.typed_reader import MAX_INTEGER

MAX_BYTES = 32 * 2**20
MAX_CONTAINERS = 900_000
"""Lists and objects; counted before parsing, so that memory is bounded."""
MAX_VALUES = 4_000_000
_TOO_DEEP = "lists and objects are nested too deep; nest less"
MAX_DEPTH = 80
"""Levels of lists and objects, so that no reader of them runs out of stack."""


def plain_data(text_or_path: str | Path) -> tuple[Any, str]:
    """Parse JSON text, or the file at a path.

    Parameters
    ----------
    text_or_path : str or Path
        Text whose first sign is ``{`` or ``[`` is JSON itself, any other the path of a file.

    Returns
    -------
    object, str
        Lists, dicts, texts, finite numbers, flags and None; and what to call the source in errors.

    Raises
    ------
    UnusableInput
        No file, too large, not UTF-8, no JSON, nested too deep, a key twice, NaN or infinity, an
        integer beyond 2**53.

    Examples
    --------
    >>> plain_data('{"a": [1, 2.5]}')
    ({'a': [1, 2.5]}, 'JSON text')
    """
    if isinstance(text_or_path, str) and text_or_path.lstrip("\ufeff \t\r\n")[:1] in ("{", "["):
        where, text = "JSON text", text_or_path.lstrip("\ufeff")
        _check_size(where, len(text))
    else:
        where, text = _file_text(Path(text_or_path))
    _check_counts(where, text)
    found = _parsed(where, text)
    _check_depth(where, found)
    return found, where


def _check_size(where: str, size: int) -> None:
    if size > MAX_BYTES:
        raise UnusableInput(
            f"{where}: {size / 2**20:.1f} MiB is more than the {MAX_BYTES // 2**20} MiB that are "
            "read; split it"
        )


def _file_text(file: Path) -> tuple[str, str]:
    where = ascii(str(file))[1:-1]
    where = where if len(where) <= 100 else f"...{where[-97:]}"
    try:
        found = file.stat()
        if not stat.S_ISREG(found.st_mode):
            raise UnusableInput(f"{where}: this is not a file; give the path of a .json file")
        _check_size(where, found.st_size)
        with open(file, "rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, UnusableInput):
            raise
        reason = getattr(error, "strerror", None) or "no valid path"
        raise UnusableInput(
            f"{where}: cannot be opened ({reason}); give the path of a .json file, or JSON text "
            "that begins with {"
        ) from None
    _check_size(where, len(data))
    try:
        return where, data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UnusableInput(
            f"{where}: byte {error.start} is not UTF-8; save the file as UTF-8"
        ) from None


def _short(text: str) -> str:
    shown = ascii(text)[1:-1]
    return shown if len(shown) <= 100 else shown[:97] + "..."


def _check_counts(where: str, text: str) -> None:
    containers = text.count("{") + text.count("[")
    if containers > MAX_CONTAINERS or text.count(",") > MAX_VALUES:
        raise UnusableInput(
            f"{where}: {containers} lists and objects or {text.count(',')} values are more than "
            f"the {MAX_CONTAINERS} and {MAX_VALUES} that are read; split it"
        )


def _check_depth(where: str, found: Any) -> None:
    level = [found]
    for _ in range(MAX_DEPTH):
        inner = (v.values() if isinstance(v, dict) else v for v in level)
        level = [v for values in inner for v in values if isinstance(v, dict | list)]
        if not level:
            return
    raise UnusableInput(f"{where}: {_TOO_DEEP}")


def _parsed(where: str, text: str) -> Any:
    def bad(message: str) -> NoReturn:
        raise UnusableInput(f"{where}: {message}")

    def integer(digits: str) -> int:
        if len(digits) > 17 or abs(int(digits)) > MAX_INTEGER:
            bad(f"the whole number {_short(digits)} is beyond 2**53; write it as a decimal number")
        return int(digits)

    def decimal(digits: str) -> float:
        value = float(digits)
        if not math.isfinite(value):
            bad(f"the number {_short(digits)} is too large for a double; give a smaller one")
        return value

    def constant(word: str) -> float:
        bad(f"{word} is not a finite number; give a finite one")

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            seen: set[str] = set()
            twice = next(k for k, _ in pairs if k in seen or seen.add(k))  # type: ignore[func-returns-value]
            bad(f"the key {_short(twice)!r} is given twice in one object; keep one")
        return found

    try:
        return json.loads(
            text,
            parse_int=integer,
            parse_float=decimal,
            parse_constant=constant,
            object_pairs_hook=unique,
        )
    except json.JSONDecodeError as error:
        ended = error.pos >= len(text.rstrip()) - 1 or error.msg.startswith("Unterminated")
        cut = "the file seems cut off; " if ended else ""
        bad(
            f"this is no JSON: {error.msg} at line {error.lineno} column {error.colno}; {cut}"
            "write it again with the program that made it, or correct it there"
        )
    except RecursionError:
        bad(_TOO_DEEP)
