"""The report as one page of HTML."""

from __future__ import annotations

from html import escape
from pathlib import Path

from bondgraph.support.whole_file import write_atomically
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report import checked, evidence, places, sections, traits
from identification.diagnosis.report.style import CSS


def page(d: Diagnosis) -> str:
    """Return the report of `d` as HTML: inline styles and figures, no scripts, no network.

    Parameters
    ----------
    d : Diagnosis
        Of any kind; sections without content are left out.
    """
    parts = (
        sections.answer(d),
        sections.raw(d),
        evidence.advice(d),
        sections.before_after(d),
        sections.graph(d),
        sections.law(d),
        sections.equations(d),
        evidence.rivals(d),
        checked.checked(d),
        traits.characterised(d),
        places.places(d),
        evidence.parameters(d),
        checked.limits(d),
    )
    body = "\n".join(p for p in parts if p)
    title = escape(f"Diagnosis of {d.model} on {d.recording.name}")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>{CSS}</style>\n</head>\n<body>\n{body}\n"
        "<footer>Made by Bondsight from the diagnosis alone: the same input gives the same page."
        "</footer>\n</body>\n</html>\n"
    )


def write_report(d: Diagnosis, folder: Path) -> Path:
    """Write ``report.html`` into `folder` atomically; returns its path."""
    target = Path(folder) / "report.html"
    write_atomically(target, page(d))
    return target
