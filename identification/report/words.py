"""Small words that every text needs."""

from __future__ import annotations

from collections.abc import Iterable


def spaced(name: str) -> str:
    """Return a name of the vocabulary as words."""
    return name.replace("_", " ")


def listed(names: Iterable[str]) -> str:
    """Return names as ``a, b and c``."""
    found = list(names)
    return " and ".join(filter(None, [", ".join(found[:-1]), *found[-1:]]))


def shortened(name: str) -> str:
    """Return the name of many recordings joined as the first ones and a number.

    Examples
    --------
    >>> shortened("a + b + c + d")
    'a + b and 2 more'
    """
    parts = name.split(" + ")
    return name if len(parts) < 4 else f"{' + '.join(parts[:2])} and {len(parts) - 2} more"


def gathered(notes: Iterable[str]) -> list[str]:
    """Return notes once each where several recordings say the same, under the first one's name.

    Examples
    --------
    >>> gathered(["a: kept", "b: kept", "c: kept", "held out: d"])
    ['a and 2 more: kept', 'held out: d']
    """
    names: dict[str, list[str]] = {}
    for note in notes:
        name, sign, said = note.partition(": ")
        names.setdefault(said if sign else note, []).append(name if sign else "")
    return [
        f"{name}{f' and {len(more)} more' if more else ''}: {said}" if name else said
        for said, (name, *more) in names.items()
    ]


def ordinal(number: int) -> str:
    """Return ``first`` for 1, ``5th`` for 5."""
    return (*_ORDINALS, f"{number}th")[min(number, len(_ORDINALS) + 1) - 1]


_ORDINALS = ("first", "second", "third", "fourth")


def ended(text: str) -> str:
    """Return a sentence with its full stop."""
    return text if text.endswith((".", "!", "?")) or not text else f"{text}."


def stopped(text: str) -> str:
    """Return a sentence with its capital and its full stop."""
    return ended(text[:1].upper() + text[1:])
