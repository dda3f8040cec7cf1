"""``bondsight effects``: the catalogue of the diagnosis, as a table or one effect in full."""

from __future__ import annotations

import argparse
from typing import Any

__all__ = ["add_effects_command", "catalogue_table", "described"]


def add_effects_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("effects", help="print the catalogue of effects, or one in full")
    p.add_argument("names", nargs="*", metavar="EFFECT", help="print all that is known of these")
    p.set_defaults(run=_effects)


def _effects(options: argparse.Namespace) -> int:
    if options.names:
        print("\n\n".join(described(n) for n in options.names))
    else:
        print(catalogue_table())
    return 0


def catalogue_table() -> str:
    """Return the catalogue as a Markdown table, one row an effect, in its own order."""
    from identification.diagnosis.catalogue import CATALOGUE
    from identification.report.tables import markdown

    rows = [(f"`{e.name}`", e.family, f"`{e.law}`", e.sentence) for e in CATALOGUE]
    return markdown(("effect", "family", "law", "in words"), rows)


def described(name: str) -> str:
    """Return everything the catalogue says of one effect, one line each.

    Raises
    ------
    UnknownName
        If there is none of that name; the nearest names are given.
    """
    from identification.diagnosis.catalogue import by_name

    e = by_name(name)
    lines = [f"{e.name} ({e.family}): {e.sentence}"]
    said = (
        ("law", e.law), ("looks like", e.looks), ("contains", ", ".join(e.simpler)),
        ("confused with", ", ".join(e.confused_with)), ("separated by", e.separated_by),
        ("source", e.source),
    )  # fmt: skip
    return "\n".join([*lines, *(f"  {word}: {text}" for word, text in said if text)])
