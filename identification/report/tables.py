"""Tables as plain text and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence


def aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines with columns two spaces apart."""
    table = [list(heads), *[list(r) for r in rows]]
    widths = [max(len(r[i]) for r in table) for i in range(len(heads))]
    return ["  ".join(t.ljust(w) for t, w in zip(r, widths, strict=True)).rstrip() for r in table]


def markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    return "\n".join(f"| {' | '.join(r)} |" for r in (heads, ["---"] * len(heads), *rows))
