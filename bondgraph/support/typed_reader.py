"""Plain data as frozen dataclasses, by their annotations: each value checked, each place told.

What a field is called, what it may hold and whether it is needed stands in its class alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from bondgraph.support.bounds import MAX_NAME, Bound
from bondgraph.support.errors import BondsightError, UnusableInput, nearest

MAX_TEXT = 2000
MAX_LIST = 100_000
MAX_INTEGER = 2**53
"""Whole numbers beyond it are no exact floats."""
_BUILD_ERRORS = (
    BondsightError,
    ArithmeticError,
    AttributeError,
    LookupError,
    TypeError,
    ValueError,
    RuntimeWarning,
)
_T = TypeVar("_T")
Reader = Callable[[Any, Any, str], Any]


@dataclass(frozen=True, slots=True)
class Rules:
    """How to read what is no plain dataclass.

    Attributes
    ----------
    readers : mapping of type to callable
        ``(annotation, plain data, place) -> value`` for a class with its subclasses, for a type of
        numbers or texts in place of the usual, and for `Any`.
    names : tuple of type
        Classes that annotations name but their modules import for type checkers only.
    surplus : bool
        Fields that nobody knows are passed over.
    complete : bool
        Fields with a default are needed too.
    """

    readers: Mapping[Any, Reader] = field(default_factory=dict)
    names: tuple[type, ...] = ()
    surplus: bool = False
    complete: bool = False

    def reader(self, kind: Any) -> Reader | None:
        """Return the reader of an annotation, if it has one of its own."""
        if kind in _SCALARS or not isinstance(kind, type):
            return self.readers.get(kind) if kind in _SCALARS or kind is Any else None
        return next((self.readers[c] for c in kind.__mro__ if c in self.readers), None)


_PLAIN = Rules()


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


def any_text(_: Any, value: Any, place: str) -> str:
    """Return any text: who prints it takes out what a terminal would obey."""
    if not isinstance(value, str):
        raise bad(place, value, "text")
    return value


def hint(name: Any, known: Iterable[str]) -> str:
    """Return the nearest names and some that exist, as the end of an error."""
    known = tuple(known)
    more = ", ..." if len(known) > 12 else ""
    return f"{_meant(name, known) or ';'} known: {', '.join(known[:12]) or 'none'}{more}"


def _meant(name: Any, known: tuple[str, ...]) -> str:
    close = nearest(name[:MAX_NAME], known[:2000]) if isinstance(name, str) else ()
    return f"; did you mean {' or '.join(map(shown, close))}?" if close else ""


def chosen(table: Mapping[str, _T], name: Any, place: str, what: str) -> _T:
    """Return what a name in a file means, or raise with the nearest names."""
    if not isinstance(name, str) or name not in table:
        raise UnusableInput(f"{place}: no {what} {shown(name)}{hint(name, table)}")
    return table[name]


def require_object(value: Any, place: str, what: str) -> Mapping[str, Any]:
    """Return a JSON object, or raise."""
    if not isinstance(value, Mapping):
        raise bad(place, value, f"an object ({what})")
    return value


def require_list(value: Any, place: str, most: int = MAX_LIST) -> Sequence[Any]:
    """Return a JSON list of at most `most` entries, or raise."""
    if not isinstance(value, list | tuple):
        raise bad(place, value, "a list")
    if len(value) > most:
        raise UnusableInput(f"{place}: {len(value)} entries are more than the {most} allowed")
    return value


def make(action: Callable[[], _T], place: str) -> _T:
    """Return ``action()``; what it raises becomes one line with the place."""
    try:
        with np.errstate(all="ignore"):
            return action()
    except _BUILD_ERRORS as error:
        text = str(error) if isinstance(error, BondsightError) else type(error).__name__
        raise UnusableInput(f"{place}: {text}" if place else text) from None


def hints_of(cls: Any, rules: Rules = _PLAIN) -> Mapping[str, Any]:
    """Return the annotation of every field that a dataclass is made from."""
    return _hints(cls, rules.names)


@cache
def _hints(cls: Any, names: tuple[type, ...]) -> Mapping[str, Any]:
    found = get_type_hints(cls, None, {c.__name__: c for c in names}, include_extras=True)
    return {f.name: found[f.name] for f in fields(cls) if f.init}


@cache
def needed(cls: Any) -> tuple[str, ...]:
    """Return the fields of a dataclass that have no default."""
    return tuple(
        f.name
        for f in fields(cls)
        if f.init and f.default is MISSING and f.default_factory is MISSING
    )


def off_default(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the fields of a dataclass that differ from their defaults in value or type."""
    for f in fields(value):
        held = getattr(value, f.name)
        if held is not f.default and (type(held) is not type(f.default) or held != f.default):
            yield f.name, held


def record(
    cls: Callable[..., _T], value: Any, place: str, rules: Rules = _PLAIN, what: str = ""
) -> _T:
    """Make a dataclass from a mapping of its fields.

    Parameters
    ----------
    cls : type
        The dataclass; its `__post_init__` may refuse values too.
    value : object
        Plain data: mappings with text keys, lists or tuples, texts, numbers, flags and None.
    place : str
        Where it stands, for errors; may be empty for the outermost one.
    rules : Rules, optional
        How to read annotations beyond plain data.
    what : str, optional
        What to call the dataclass in errors.

    Raises
    ------
    UnusableInput
        A field is unknown or missing, or holds what it must not; one line says which and where.
    TypeError
        An annotation is none that can be read: a mistake of the program, not of the file.

    Examples
    --------
    >>> from bondgraph.graph.parameter import Parameter
    >>> record(Parameter, {"name": "k", "value": 2.0}, "parameters[0]").unit
    '1'
    """
    values = read_fields(cls, value, place, rules, what)
    return make(lambda: cls(**values), place)


def read_fields(
    cls: Any, value: Any, place: str, rules: Rules = _PLAIN, what: str = ""
) -> dict[str, Any]:
    """Return the checked fields of a dataclass without making it; see `record`."""
    what = what or cls.__name__.strip("_")
    data = require_object(value, place or "the whole file", what)
    hints = hints_of(cls, rules)
    head = f"{place}: " if place else ""
    for name in data:
        if name not in hints and not rules.surplus:
            raise UnusableInput(f"{head}no field of {what} {shown(name)}{hint(name, hints)}")
    for name in hints if rules.complete else needed(cls):
        if name not in data:
            raise UnusableInput(f"{head}{what} needs its field {name!r}")
    dot = f"{place}." if place else ""
    return {k: read(hints[k], v, f"{dot}{k}", rules) for k, v in data.items() if k in hints}


def read(kind: Any, value: Any, place: str, rules: Rules = _PLAIN) -> Any:
    """Return plain data as a value of an annotated type; see `record`."""
    own = rules.reader(kind)
    if own is not None:
        return own(kind, value, place)
    if kind in _SCALARS:
        return _SCALARS[kind](value, place)
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _within(kind.__metadata__, read(inner[0], value, place, rules), place)
    if origin in (Union, UnionType):
        return _one_of(inner, value, place, rules)
    if origin is tuple:
        return _several(inner, value, place, rules)
    if origin is list:
        return list(_several((*inner, ...), value, place, rules))
    if origin is Literal:
        return _literal(inner, value, place)
    if origin in (Mapping, dict):
        content = require_object(value, place, "names and values")
        return {
            read(inner[0], k, place, rules): read(inner[1], v, f"{place}.{shown(k)[1:-1]}", rules)
            for k, v in content.items()
        }
    if is_dataclass(kind):
        return record(kind, value, place, rules)  # type: ignore[arg-type]
    if kind is Any:
        return value
    raise TypeError(f"{place}: no reader for the annotation {kind}; give one in Rules(readers=)")


def _within(bounds: Iterable[Bound], value: Any, place: str) -> Any:
    for bound in bounds:
        if not bound.holds(value):
            raise bad(place, value, bound.wanted + _meant(value, bound.known))
    return value


def _one_of(kinds: tuple[Any, ...], value: Any, place: str, rules: Rules) -> Any:
    if value is None and NoneType in kinds:
        return None
    if Any in kinds:
        return read(Any, value, place, rules)
    *others, last = (k for k in kinds if k is not NoneType)
    for kind in others:
        try:
            return read(kind, value, place, rules)
        except UnusableInput:
            continue
    return read(last, value, place, rules)


def _literal(choices: tuple[Any, ...], value: Any, place: str) -> Any:
    for choice in choices:
        if type(value) is type(choice) and value == choice:
            return choice
    raise bad(place, value, f"one of {', '.join(map(shown, choices))}")


def _several(inner: tuple[Any, ...], value: Any, place: str, rules: Rules) -> tuple[Any, ...]:
    found = require_list(value, place)
    kinds = inner[:1] * len(found) if inner[-1] is Ellipsis else inner
    if len(kinds) != len(found):
        raise UnusableInput(f"{place}: {len(found)} entries, {len(kinds)} are needed")
    return tuple(
        read(k, v, f"{place}[{i}]", rules)
        for i, (k, v) in enumerate(zip(kinds, found, strict=True))
    )


def _number(value: Any, place: str) -> float | int:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise bad(place, value, "a number")
    if isinstance(value, float):
        if not math.isfinite(value):
            raise bad(place, value, "a finite number")
        return float(value)  # also of a NumPy float
    if abs(value) > MAX_INTEGER:
        raise bad(place, value, "a whole number within 2**53")
    return value


def _whole(value: Any, place: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise bad(place, value, "a whole number")
    if abs(value) > MAX_INTEGER:
        raise bad(place, value, "a whole number within 2**53")
    return value


def _text(value: Any, place: str) -> str:
    if not isinstance(value, str):
        raise bad(place, value, "text")
    if len(value) > MAX_TEXT:
        raise UnusableInput(f"{place}: {len(value)} signs are more than the {MAX_TEXT} allowed")
    if any(not (c.isprintable() or c in "\n\t") for c in value):
        raise bad(place, value, "printable text")
    return value


def _flag(value: Any, place: str) -> bool:
    if not isinstance(value, bool):
        raise bad(place, value, "true or false")
    return value


_SCALARS: Mapping[Any, Callable[[Any, str], Any]] = {
    float: _number,
    int: _whole,
    str: _text,
    bool: _flag,
}
