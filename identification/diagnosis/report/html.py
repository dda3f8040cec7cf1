"""Small pieces of HTML; every text goes through `escape` here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

__all__ = ["bullets", "cell", "escape", "facts", "figure", "paragraph", "section", "table"]


def section(title: str, *parts: str) -> str:
    """Headed section; empty when it holds nothing."""
    body = "\n".join(p for p in parts if p)
    return f"<section>\n<h2>{escape(title)}</h2>\n{body}\n</section>" if body else ""


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
    return f'<figure class="{kind}">{svg}{below}</figure>'


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
) -> str:
    """Table of plain texts.

    Parameters
    ----------
    numeric : sequence of int
        Columns set to the right.
    kinds : sequence of str
        Class of each row.
    """
    head = "".join(
        f'<th class="n">{escape(h)}</th>' if i in numeric else f"<th>{escape(h)}</th>"
        for i, h in enumerate(heads)
    )
    body = []
    for k, row in enumerate(rows):
        kind = kinds[k] if k < len(kinds) else ""
        cells = "".join(cell(t, "n" if i in numeric else "w") for i, t in enumerate(row))
        body.append(f'<tr class="{kind}">{cells}</tr>' if kind else f"<tr>{cells}</tr>")
    if not body:
        return ""
    return (
        f'<div class="scroll"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(body)}</tbody></table></div>"
    )
