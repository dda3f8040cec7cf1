"""What a field may hold beyond its type, said once in its annotation; readers and schemas use it.

Nothing is checked when a program makes a value itself: `bondgraph.support.typed_reader` does it for
files, and `bondgraph.graph.checking` for the laws of a graph.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any, get_args, get_origin

MAX_NAME = 200


@dataclass(frozen=True, slots=True, eq=False)
class Bound:
    """A condition on a value that has its type already.

    Attributes
    ----------
    wanted : str
        What it has to be, as the end of an error: ``"a number above 0"``.
    holds : callable
        ``value -> bool``.
    schema : mapping
        The same for JSON Schema, as far as it can be said there.
    known : tuple of str
        Words that are allowed, if they are few.
    """

    wanted: str
    holds: Callable[[Any], bool]
    schema: Mapping[str, Any] = field(default_factory=dict)
    known: tuple[str, ...] = ()


def whole(low: int, high: int) -> Bound:
    """Bound of a whole number, both ends allowed."""
    return Bound(
        f"a whole number from {low} to {high}",
        lambda v: low <= v <= high,
        {"minimum": low, "maximum": high},
    )


def one_of(*words: str) -> Bound:
    """Bound of a text to a few words."""
    return Bound(f"one of {', '.join(words)}", lambda v: v in words, {"enum": list(words)}, words)


def least(count: int) -> Bound:
    """Bound of a list by its number of entries."""
    return Bound(
        f"long enough: at least {count} entries are needed",
        lambda v: len(v) >= count,
        {"minItems": count},
    )


def broken(kind: Any, value: Any) -> str:
    """Return what a value has to be by the bounds of its annotation and is not; "" if nothing."""
    inner, several = get_args(kind), get_origin(kind) is tuple
    if get_origin(kind) is Annotated:
        try:
            missed = next((b.wanted for b in kind.__metadata__ if not b.holds(value)), "")
        except (TypeError, AttributeError):
            missed = "a value of its type"
        return missed or broken(inner[0], value)
    if several and len(inner) == 2 and inner[1] is Ellipsis:
        return next((said for v in value if (said := broken(inner[0], v))), "")
    return ""


def _is_name(text: str) -> bool:
    return text.isidentifier() and not text.startswith("_") and len(text) <= MAX_NAME


NonNegative = Annotated[float, Bound("a number of at least 0", lambda v: v >= 0, {"minimum": 0})]
Positive = Annotated[float, Bound("a number above 0", lambda v: v > 0, {"exclusiveMinimum": 0})]
NonZero = Annotated[float, Bound("a number other than 0", lambda v: v != 0, {"not": {"const": 0}})]
Count = Annotated[int, Bound("a whole number of at least 0", lambda v: v >= 0, {"minimum": 0})]
Name = Annotated[
    str,
    Bound(
        f"a name: letters, digits and underscores, a letter first, at most {MAX_NAME}",
        _is_name,
        {"pattern": r"^[^\W\d_]\w*$", "maxLength": MAX_NAME},
    ),
]
Signal = Annotated[
    str,
    Bound(
        f"a name, or that of a signal of a bond such as e_a>b, at most {MAX_NAME}",
        lambda text: _is_name(text.replace(">", "_", 1)) and text.strip(">") == text,
        {"pattern": r"^[^\W\d_]\w*(>\w+)?$", "maxLength": MAX_NAME},
    ),
]
Rising = Annotated[
    tuple[float, ...],
    least(2),
    Bound(
        "in rising order, each above the one before", lambda v: all(a < b for a, b in pairwise(v))
    ),
]
