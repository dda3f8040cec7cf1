"""The report as one page of HTML."""

from __future__ import annotations

from pathlib import Path

from bondgraph.support.whole_file import write_atomically
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report import checked, evidence, places, sections, traits
from identification.report import html


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
    title = f"Diagnosis of {d.model} on {d.recording.name}"
    return html.page("diagnosis", title, parts, source="diagnosis", same="input")


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
