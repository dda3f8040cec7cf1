"""Frozen dataclasses of plain fields to mappings and back, with every field checked."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

from bondgraph.support.typed_reader import Rules, any_text, bad, record

_T = TypeVar("_T")


def fields_of(value: Any) -> Any:
    """Return a dataclass as a mapping of plain values, nested ones included."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: fields_of(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {k: fields_of(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return tuple(fields_of(v) for v in value)
    return value


def made_from(kind: type[_T], content: Any, place: str) -> _T:
    """Make a dataclass from what `fields_of` returned.

    Raises
    ------
    UnusableInput
        A field is missing, unknown or of another type; the line says which.
    """
    return record(kind, content, place, _RULES)


def _number(_: Any, value: Any, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise bad(place, value, "a number")
    return float(value)


# a bench may say infinity, and more than a stranger
_RULES = Rules({float: _number, str: any_text})
