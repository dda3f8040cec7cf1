"""Forms of single fields: what a value may be, how it is read from and written to plain data.

A form checks on the way in and on the way out, so what is written can be read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bondgraph.export.graph_json.json_text import MAX_INTEGER
from bondgraph.support.errors import UnusableInput, nearest

__all__ = [
    "FLAG",
    "NAME",
    "NON_NEGATIVE",
    "NUMBER",
    "POSITIVE",
    "TEXT",
    "Form",
    "bad",
    "choice",
    "integer",
    "listed",
    "number",
    "optional",
    "require_known",
    "require_list",
    "require_object",
    "rising",
    "shown",
]

MAX_TEXT = 2000
MAX_NAME = 200
MAX_LIST = 100_000


@dataclass(frozen=True, slots=True)
class Form:
    """How one field is read and written; both take the value, its place and the symbols.

    Attributes
    ----------
    read : callable
        ``(plain data, place, symbols) -> value of the field``.
    write : callable
        ``(value of the field, place, symbols) -> plain data``.
    """

    read: Callable[[Any, str, Any], Any]
    write: Callable[[Any, str, Any], Any]


def shown(value: Any) -> str:
    """Return a value for an error, in ASCII and short.

    Examples
    --------
    >>> shown({"a": [1, 2]}), shown("x" * 50), shown(True)
    ('an object', "'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...'", 'true')
    """
    if isinstance(value, Mapping):
        return "an object"
    if isinstance(value, list | tuple):
        return "a list"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, str) and len(value) > 40:
        value = value[:37] + "..."
    text = ascii(value)
    return text if len(text) <= 80 else text[:77] + "..."


def bad(place: str, value: Any, wanted: str) -> UnusableInput:
    """Make (not raise) the error for a value of the wrong kind."""
    return UnusableInput(f"{place}: {shown(value)} is not {wanted}")


def require_object(value: Any, place: str, what: str) -> Mapping[str, Any]:
    """Return a JSON object, or raise."""
    if not isinstance(value, dict):
        raise bad(place, value, f"an object ({what})")
    return value


def require_list(value: Any, place: str, what: str, most: int = MAX_LIST) -> Sequence[Any]:
    """Return a JSON list of at most `most` entries, or raise."""
    if not isinstance(value, list | tuple):
        raise bad(place, value, f"a list ({what})")
    if len(value) > most:
        raise UnusableInput(f"{place}: {len(value)} entries are more than the {most} allowed")
    return value


def require_known(given: Iterable[str], known: Iterable[str], place: str, what: str) -> None:
    """Raise for the first name that is not known, with the nearest ones."""
    table = tuple(known)
    for name in given:
        if name not in table:
            raise UnusableInput(f"{place}: no {what} {shown(name)}{hint(name, table)}")


def hint(name: Any, known: Sequence[str]) -> str:
    """Return the nearest names and some that exist, as the end of an error."""
    close = nearest(name[:MAX_NAME], known[:2000]) if isinstance(name, str) else ()
    meant = f"; did you mean {' or '.join(map(shown, close))}?" if close else ""
    more = ", ..." if len(known) > 12 else ""
    return f"{meant or ';'} known: {', '.join(known[:12]) or 'none'}{more}"


def _same(check: Callable[[Any, str], Any]) -> Form:
    def both(value: Any, place: str, _: Any) -> Any:
        return check(value, place)

    return Form(both, both)


def _finite(value: Any, place: str) -> float | int:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise bad(place, value, "a number")
    if isinstance(value, float):
        if not math.isfinite(value):
            raise bad(place, value, "a finite number")
        return float(value)  # also of a NumPy float
    if abs(value) > MAX_INTEGER:
        raise bad(place, value, "a whole number within 2**53")
    return value


def number(low: float = -math.inf, *, strict: bool = False) -> Form:
    """Form of a finite number, at least (`strict`: above) `low`."""

    def check(value: Any, place: str) -> float | int:
        found = _finite(value, place)
        if found < low or (strict and found == low):
            raise bad(place, value, f"a number {'above' if strict else 'of at least'} {low:g}")
        return found

    return _same(check)


def integer(low: int, high: int) -> Form:
    """Form of a whole number between two bounds, both allowed."""

    def check(value: Any, place: str) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise bad(place, value, f"a whole number from {low} to {high}")
        return value

    return _same(check)


def _text(value: Any, place: str) -> str:
    if not isinstance(value, str):
        raise bad(place, value, "text")
    if len(value) > MAX_TEXT:
        raise UnusableInput(f"{place}: {len(value)} signs are more than the {MAX_TEXT} allowed")
    if any(not (c.isprintable() or c in "\n\t") for c in value):
        raise bad(place, value, "printable text")
    return value


def _name(value: Any, place: str) -> str:
    text = _text(value, place)
    if not text.isidentifier() or text.startswith("_") or len(text) > MAX_NAME:
        raise bad(
            place, value, "a name: letters, digits and underscores, a letter first, at most 200"
        )
    return text


def _flag(value: Any, place: str) -> bool:
    if not isinstance(value, bool):
        raise bad(place, value, "true or false")
    return value


NUMBER = number()
NON_NEGATIVE = number(0.0)
POSITIVE = number(0.0, strict=True)
TEXT = _same(_text)
NAME = _same(_name)
FLAG = _same(_flag)


def choice(*words: str) -> Form:
    """Form of one of a few words."""

    def check(value: Any, place: str) -> str:
        if value not in words:
            raise bad(place, value, f"one of {', '.join(words)}")
        return str(value)

    return _same(check)


def optional(form: Form) -> Form:
    """Form of a value or null."""

    def read(value: Any, place: str, symbols: Any) -> Any:
        return None if value is None else form.read(value, place, symbols)

    def write(value: Any, place: str, symbols: Any) -> Any:
        return None if value is None else form.write(value, place, symbols)

    return Form(read, write)


def listed(form: Form, least: int = 0, most: int = MAX_LIST) -> Form:
    """Form of a tuple of values of one form."""

    def entries(value: Any, place: str) -> Sequence[Any]:
        found = require_list(value, place, f"at least {least} entries", most)
        if len(found) < least:
            raise UnusableInput(f"{place}: {len(found)} entries, at least {least} are needed")
        return found

    def read(value: Any, place: str, symbols: Any) -> tuple[Any, ...]:
        found = entries(value, place)
        return tuple(form.read(v, f"{place}[{i}]", symbols) for i, v in enumerate(found))

    def write(value: Any, place: str, symbols: Any) -> list[Any]:
        found = entries(value, place)
        return [form.write(v, f"{place}[{i}]", symbols) for i, v in enumerate(found)]

    return Form(read, write)


def rising(least: int) -> Form:
    """Form of numbers in strictly rising order."""
    plain = listed(NUMBER, least)

    def check(found: Sequence[Any], place: str) -> None:
        for i in range(1, len(found)):
            if not found[i] > found[i - 1]:
                raise bad(f"{place}[{i}]", found[i], f"above {place}[{i - 1}]")

    def read(value: Any, place: str, symbols: Any) -> Any:
        found = plain.read(value, place, symbols)
        check(found, place)
        return found

    def write(value: Any, place: str, symbols: Any) -> Any:
        found = plain.write(value, place, symbols)
        check(found, place)
        return found

    return Form(read, write)
