"""The studio as one page of HTML: scripts, styles and data inside, nothing fetched."""

from __future__ import annotations

import base64
import hashlib
from importlib.resources import files
from pathlib import Path

from bondgraph.support.whole_file import write_atomically
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report import checked, evidence, places, sections, traits
from identification.diagnosis.report.found import warmth_of
from identification.diagnosis.studio.content import content
from identification.diagnosis.studio.packing import embedded
from identification.report import html


def page(d: Diagnosis) -> str:
    """Return the studio of `d` as HTML that opens from disk without network.

    Its content-security policy allows the page's own script, known by its hash, and no request.

    Parameters
    ----------
    d : Diagnosis
        Of any kind; without a fit the page has the sections of the report alone.
    """
    script = _short(asset("plot.js") + asset("studio.js"))
    panel = asset("panel.html").replace("<!--graph-->", sections.drawn(d, warmth_of(d)))
    parts = (
        sections.answer(d),
        sections.raw(d),
        evidence.advice(d),
        html.trusted(panel),
        sections.errors(d),
        sections.law(d, planes=False),
        sections.equations(d),
        evidence.rivals(d),
        checked.checked(d),
        traits.characterised(d, pictures=False),
        places.places(d, pictures=False),
        evidence.parameters(d),
        checked.limits(d),
    )
    head = f'<meta http-equiv="Content-Security-Policy" content="{policy(script)}">'
    foot = (
        f'<script type="application/json" id="data">{embedded(content(d))}</script>\n'
        f"<script>{script}</script>"
    )
    return html.page(
        "diagnosis studio", f"Studio: {d.model} on {d.recording.name}", parts, source="diagnosis",
        same="input", head=f"{head}\n<style>{asset('studio.css')}</style>", foot=foot,
    )  # fmt: skip


def write_studio(d: Diagnosis, folder: Path) -> Path:
    """Write ``studio.html`` into `folder` atomically; returns its path."""
    target = Path(folder) / "studio.html"
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
