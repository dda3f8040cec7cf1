"""Frozen dataclasses of plain fields to mappings and back, with every field checked."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Hashable, Mapping
from functools import cache
from typing import Any, TypeVar

from bondgraph.support.errors import UnusableInput

__all__ = ["fields_of", "made_from"]

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
    if not isinstance(content, Mapping):
        raise UnusableInput(f"{place}: is {type(content).__name__}, not a mapping")
    types_of = _types(kind)  # type: ignore[arg-type]
    strange = [str(k) for k in content if k not in types_of]
    missing = [
        f.name
        for f in dataclasses.fields(kind)  # type: ignore[arg-type]
        if f.name not in content
        and f.default is dataclasses.MISSING
        and f.default_factory is dataclasses.MISSING
    ]
    if strange or missing:
        what = f"has {', '.join(strange)}" if strange else f"lacks {', '.join(missing)}"
        raise UnusableInput(f"{place}: {what}; it was changed or is of another version")
    return kind(**{k: _value(types_of[k], v, f"{place}.{k}") for k, v in content.items()})


@cache
def _types(kind: Hashable) -> dict[str, Any]:
    hints = typing.get_type_hints(kind)
    return {f.name: hints[f.name] for f in dataclasses.fields(kind)}  # type: ignore[arg-type]


def _value(kind: Any, value: Any, place: str) -> Any:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any:
        return value
    if origin in (types.UnionType, typing.Union):
        if value is None and type(None) in arguments:
            return None
        inner = [a for a in arguments if a is not type(None)]
        return _value(inner[0], value, place)
    if origin is tuple and isinstance(value, list | tuple):
        return tuple(_value(arguments[0], v, f"{place}[{i}]") for i, v in enumerate(value))
    if origin is not None and isinstance(value, Mapping):
        return dict(value)
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return made_from(kind, value, place)
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if isinstance(kind, type) and type(value) is kind:
        return value
    wanted = getattr(kind, "__name__", str(kind))
    raise UnusableInput(f"{place}: {value!r} is {type(value).__name__}, not {wanted}")
