"""Small pieces of HTML; every text goes through `escape` here."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape

__all__ = [
    "bar", "bullets", "cell", "escape", "facts", "figure", "folded", "paragraph", "section",
    "table", "tiles",
]  # fmt: skip


def section(title: str, *parts: str) -> str:
    """Headed section; empty when it holds nothing."""
    body = "\n".join(p for p in parts if p)
    if not body:
        return ""
    name = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
    return (
        f'<section aria-labelledby="s-{name}">\n<h2 id="s-{name}">{escape(title)}</h2>\n'
        f"{body}\n</section>"
    )


def heading(text: str) -> str:
    """Return a heading inside a section."""
    return f"<h3>{escape(text)}</h3>"


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph of plain text."""
    if not text:
        return ""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def figure(svg: str, caption: str = "", kind: str = "") -> str:
    """Figure with a caption; `svg` is trusted."""
    if not svg:
        return ""
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure class="{kind}">{_spoken(svg, caption)}{below}</figure>'


def _spoken(svg: str, text: str) -> str:
    """Give a picture its words for those who do not see it."""
    if not text or ' role="img"' in svg[:400]:
        return svg
    return svg.replace("<svg ", f'<svg role="img" aria-label="{escape(text)}" ', 1)


def tiles(*figures: str) -> str:
    """Figures side by side where there is room, below each other where there is none."""
    found = [f for f in figures if f]
    return f'<div class="tiles">{"".join(found)}</div>' if found else ""


def folded(summary: str, *parts: str) -> str:
    """Details behind a line; printed open."""
    body = "".join(p for p in parts if p)
    return f"<details><summary>{escape(summary)}</summary>{body}</details>" if body else ""


def bar(share: float, kind: str = "") -> str:
    """Bar of a share between 0 and 1, for a cell of a table; trusted HTML."""
    width = 100 * min(max(share, 0.0), 1.0)
    return f'<span class="bar {kind}"><span style="width:{width:.1f}%"></span></span>'


def bullets(lines: Iterable[str]) -> str:
    """List of plain texts."""
    items = "".join(f"<li>{escape(t)}</li>" for t in lines)
    return f"<ul>{items}</ul>" if items else ""


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """Names and values side by side."""
    items = "".join(f"<div><dt>{escape(k)}</dt><dd>{escape(v)}</dd></div>" for k, v in pairs if v)
    return f'<dl class="facts">{items}</dl>'


def cell(text: str, kind: str = "") -> str:
    """Cell of plain text."""
    return f'<td class="{kind}">{escape(text)}</td>' if kind else f"<td>{escape(text)}</td>"


def table(
    heads: Sequence[str],
    rows: Iterable[Sequence[str]],
    numeric: Sequence[int] = (),
    kinds: Sequence[str] = (),
    trusted: Sequence[int] = (),
) -> str:
    """Table of plain texts; on a narrow screen every row becomes a card.

    Parameters
    ----------
    numeric : sequence of int
        Columns set to the right.
    kinds : sequence of str
        Class of each row.
    trusted : sequence of int
        Columns that hold HTML made here.
    """
    head = "".join(
        f'<th scope="col"{_class("n" if i in numeric else "")}>{escape(h)}</th>'
        for i, h in enumerate(heads)
    )
    body = []
    for k, row in enumerate(rows):
        cells = []
        for i, text in enumerate(row):
            shown = text if i in trusted else escape(text)
            kind = "n" if i in numeric else "w"
            cells.append(f'<td class="{kind}" data-label="{escape(heads[i])}">{shown}</td>')
        body.append(f"<tr{_class(kinds[k] if k < len(kinds) else '')}>{''.join(cells)}</tr>")
    if not body:
        return ""
    return (
        f'<div class="scroll"><table class="cards"><thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(body)}</tbody></table></div>"
    )


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""
