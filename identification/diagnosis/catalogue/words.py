"""The catalogue in words: as a table, or one effect in full."""

from __future__ import annotations

from identification.diagnosis.catalogue import CATALOGUE, by_name
from identification.report.tables import markdown


def catalogue_table() -> str:
    """Return the catalogue as a Markdown table, one row an effect, in its own order."""
    rows = [(f"`{e.name}`", e.family, f"`{e.law}`", e.sentence) for e in CATALOGUE]
    return markdown(("effect", "family", "law", "in words"), rows)


def described(name: str) -> str:
    """Return everything the catalogue says of one effect, one line each.

    Raises
    ------
    UnknownName
        If there is none of that name; the nearest names are given.
    """
    e = by_name(name)
    lines = [f"{e.name} ({e.family}): {e.sentence}"]
    said = (
        ("law", e.law), ("looks like", e.looks), ("contains", ", ".join(e.simpler)),
        ("richer laws", ", ".join(e.richer)),
        ("confused with", ", ".join(e.confused_with)), ("separated by", e.separated_by),
        ("source", e.source),
    )  # fmt: skip
    return "\n".join([*lines, *(f"  {word}: {text}" for word, text in said if text)])
