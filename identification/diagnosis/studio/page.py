"""The page of a diagnosis in HTML: scripts, styles and data inside, nothing fetched."""

from __future__ import annotations

import base64
import hashlib
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

from bondgraph.support.whole_file import write_atomically
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report import checked, evidence, places, sections, traits
from identification.diagnosis.report.found import places_of
from identification.diagnosis.studio.content import content
from identification.diagnosis.studio.packing import embedded
from identification.report import html

BESIDE = 640
"""Pixels of the graph up to which the law plane stands beside it."""


def page(d: Diagnosis) -> str:
    """Return the page of `d` as HTML that opens from disk without network.

    Its content-security policy allows the page's own script, known by its hash, and no request.

    Parameters
    ----------
    d : Diagnosis
        Of any kind; sections without content are left out.
    """
    parts = (
        sections.answer(d),
        sections.sure(d),
        sections.beside(d),
        sections.raw(d),
        evidence.advice(d),
        _panel(d),
        sections.before_after(d),
        sections.law(d),
        sections.equations(d),
        evidence.rivals(d),
        checked.checked(d),
        traits.characterised(d),
        places.places(d),
        evidence.parameters(d),
        checked.limits(d),
    )
    return _with_script(d, parts, content(d))


def small(d: Diagnosis) -> str:
    """Return what is clicked and looked at alone, with a tenth of the points: for a notebook."""
    return _with_script(d, (_panel(d),), content(d, 0.1))


def _with_script(d: Diagnosis, parts: tuple[str, ...], data: dict[str, Any]) -> str:
    script = _short(asset("plot.js") + asset("studio.js"))
    head = f'<meta http-equiv="Content-Security-Policy" content="{policy(script)}">'
    foot = (
        f'<script type="application/json" id="data">{embedded(data)}</script>\n'
        f"<script>{script}</script>"
    )
    return html.page(
        "diagnosis studio", f"Diagnosis of {d.model} on {d.recording.name}", parts,
        source="diagnosis", same="diagnosis", head=f"{head}\n<style>{asset('studio.css')}</style>",
        foot=foot,
    )  # fmt: skip


def _panel(d: Diagnosis) -> str:
    """Return what is clicked and looked at; without a fit the model alone."""
    title = "Where in the model" if places_of(d)[0] else "The model"
    if d.nominal is None or d.data is None:
        return html.section(title, sections.graph(d))
    graph = sections.graph(d)
    width = re.search(r'<svg[^>]* width="([\d.]+)"', graph)
    wide = "wide" if width and float(width.group(1)) > BESIDE else ""
    made = asset("panel.html").replace("<!--title-->", title).replace("<!--wide-->", wide)
    return html.trusted(made.replace("<!--graph-->", graph))


def write_report(d: Diagnosis, folder: Path) -> Path:
    """Write ``report.html`` into `folder` atomically; returns its path.

    Examples
    --------
    >>> write_report(found, folder).name
    'report.html'
    """
    target = Path(folder) / "report.html"
    write_atomically(target, page(d))
    return target


def asset(name: str) -> str:
    """Return the text of a file that goes into a page."""
    return (files(__package__) / "assets" / name).read_text("utf-8")


def _short(script: str) -> str:
    """Leave out indents and the lines that only comment."""
    lines = (line.strip() for line in script.splitlines())
    return "\n".join(line for line in lines if line and not line.startswith("//"))


def policy(script: str, more: str = "") -> str:
    """Return a content-security policy that allows one script, styles inside, and `more`."""
    known = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    return (
        f"default-src 'none'; {more}script-src 'sha256-{known}'; style-src 'unsafe-inline'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
