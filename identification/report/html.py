"""Pieces of HTML from the templates beside this file; every plain text is escaped there."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cache
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("identification.report"), autoescape=True, trim_blocks=True,
        lstrip_blocks=True, undefined=StrictUndefined,
    )  # fmt: skip


@cache
def _pieces() -> Any:
    return _environment().get_template("pieces.html").module


def _piece(name: str, *values: Any) -> str:
    made: str = getattr(_pieces(), name)(*values)
    return made.strip()


def trusted(made: str) -> str:
    """Return HTML or SVG that was made here, so that no piece escapes it again."""
    from markupsafe import Markup

    return Markup(made)


def page(
    kind: str,
    title: str,
    parts: Iterable[str],
    *,
    source: str,
    same: str = "",
    head: str = "",
    foot: str = "",
) -> str:
    """Return a whole page: inline styles and figures, no network.

    Parameters
    ----------
    kind : str
        Class of the page in the style sheet.
    parts : iterable of str
        Sections; empty ones are left out.
    source, same : str
        What the page is made from, and what makes the same page again.
    head, foot : str
        Trusted HTML after the page's own style and at its end; no scripts are there otherwise.
    """
    skeleton = _environment().get_template("page.html")
    shown = [p for p in parts if p]
    ends = {"head": trusted(head), "foot": trusted(foot)}
    made = skeleton.render(kind=kind, title=title, parts=shown, source=source, same=same, **ends)
    return made + "\n"


def head(
    kicker: str, badge: tuple[str, str], sentence: str, pairs: Any, more: Iterable[str] = ()
) -> str:
    """Top of a page: badge (word and colour), the answer as a sentence, more of it, facts."""
    return _piece("head", kicker, *badge, sentence, list(pairs), list(more))


def section(title: str, *parts: str) -> str:
    """Headed section; empty when it holds nothing."""
    shown = [p for p in parts if p]
    name = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
    return _piece("section", title, name, shown) if shown else ""


def heading(text: str) -> str:
    """Return a heading inside a section."""
    return _piece("heading", text)


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph of plain text."""
    return _piece("paragraph", text, kind) if text else ""


def figure(svg: str, caption: str = "", kind: str = "") -> str:
    """Figure with a caption; `svg` is trusted, and its caption is said to who cannot see it."""
    if caption and ' role="img"' not in svg[:400]:
        said = escape(caption)
        svg = svg.replace("<svg ", f'<svg role="img" aria-label="{said}" ', 1)
    return _piece("figure", trusted(svg), caption, kind) if svg else ""


def legible(svg: str, width: float) -> str:
    """Return a drawing that scrolls in its frame rather than shrink below `width` pixels."""
    return _piece("legible", trusted(svg), f"{width:.0f}")


def folded(summary: str, *parts: str) -> str:
    """Details behind a line; printed open."""
    shown = [p for p in parts if p]
    return _piece("folded", summary, shown) if shown else ""


def box(part: str) -> str:
    """Call attention to a part."""
    return _piece("box", part) if part else ""


def bar(share: float, kind: str = "") -> str:
    """Bar of a share between 0 and 1, for a cell of a table."""
    return _piece("bar", f"{100 * min(max(share, 0.0), 1.0):.1f}", kind)


def bullets(lines: Iterable[str]) -> str:
    """List of plain texts."""
    shown = list(lines)
    return _piece("listed", shown, "ul") if shown else ""


def numbered(lines: Iterable[str], first: int = 1) -> str:
    """List of plain texts with their numbers."""
    shown = list(lines)
    return _piece("listed", shown, "ol", first) if shown else ""


def remarks(found: Sequence[tuple[str, str, str]]) -> str:
    """List of remarks: text, what to try, class."""
    return _piece("remarks", found) if found else ""


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """Names and values side by side."""
    return _piece("facts", list(pairs))


def code(text: str) -> str:
    """Return text in a fixed pitch."""
    return _piece("code", text)


def table(
    heads: Sequence[str],
    rows: Iterable[Sequence[str]],
    numeric: Sequence[int] = (),
    kinds: Sequence[str] = (),
) -> str:
    """Table of texts; on a narrow screen every row becomes a card.

    Parameters
    ----------
    numeric : sequence of int
        Columns set to the right.
    kinds : sequence of str
        Class of each row.
    """
    body = list(rows)
    padded = [*kinds, *[""] * (len(body) - len(kinds))]
    return _piece("table", heads, body, numeric, padded) if body else ""


def equations(rows: Sequence[tuple[str, str, str]]) -> str:
    """Table of changed equations: before or after, the equation, what it is."""
    return _piece("equations", rows) if rows else ""


def block(*parts: str) -> str:
    """Parts below each other, for a notebook."""
    return _piece("block", [p for p in parts if p])
