"""Tables as plain text and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Any

from bondgraph.support.errors import UnusableInput


def aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines with columns two spaces apart."""
    table = [list(heads), *[list(r) for r in rows]]
    widths = [max(len(r[i]) for r in table) for i in range(len(heads))]
    return ["  ".join(t.ljust(w) for t, w in zip(r, widths, strict=True)).rstrip() for r in table]


def markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    return "\n".join(f"| {' | '.join(r)} |" for r in (heads, ["---"] * len(heads), *rows))


def library(name: str, method: str) -> Any:
    """Import what only tables for other programs need.

    Raises
    ------
    UnusableInput
        It is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        need = f"{method} needs {name}: pip install 'bondsight[tables]'"
        raise UnusableInput(need) from error
