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


def ended(text: str) -> str:
    """Return a sentence with its full stop."""
    return text if text.endswith((".", "!", "?")) or not text else f"{text}."


def stopped(text: str) -> str:
    """Return a sentence with its capital and its full stop."""
    return ended(text[:1].upper() + text[1:])
