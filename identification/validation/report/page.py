"""The report as one page of HTML: inline styles and figures, no scripts, no network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from bondgraph.support.errors import UnusableInput
from bondgraph.support.whole_file import replacing
from identification.diagnosis.report.style import CSS
from identification.estimation.result import Estimation
from identification.estimation.single_record import Fit
from identification.estimation.starts import Starts
from identification.validation.compare import Comparison
from identification.validation.judge import Judgement, judge
from identification.validation.report import sections
from identification.validation.report.origin import origin
from identification.validation.validation_data import ValidationData

MORE_CSS = """
td.w{overflow-wrap:break-word}
ul.try{list-style:none;padding-left:0}
ul.try li{margin:8px 0;padding-left:12px;border-left:3px solid #d97706}
ul.try li.note{border-left-color:#9aa5b1}
ul.try .advice{display:block;color:var(--soft)}
@media (max-width:700px){td.w{min-width:7em}figure{overflow-x:auto}
 figure svg{min-width:620px;max-width:none}dl.facts{grid-template-columns:1fr 1fr}}
@media print{figure svg{max-width:100%}.scroll{overflow:visible}table,th{font-size:7pt}
 th,td{padding:2px 5px 2px 0}td.n,th.n{white-space:normal}}
"""

Judged = Judgement | Estimation | Starts | Fit | ValidationData


def page(
    fit: Judged,
    *,
    findings: Sequence[object] = (),
    comparison: Comparison | None = None,
    command: str = "",
) -> str:
    """Return the report of a fit as HTML.

    Parameters
    ----------
    fit : Judgement, or anything that `judge` takes
        Give a `Judgement` to add classes of the parameters or many starts.
    findings : sequence
        What was found in the data before the fit; each is printed with ``str``.
    comparison : Comparison, optional
        The fit among others.
    command : str
        What made the fit.
    """
    j = fit if isinstance(fit, Judgement) else judge(fit)
    parts = (
        sections.answer(j),
        sections.words(j),
        sections.before(findings),
        sections.parameters(j),
        sections.errors(j),
        sections.residuals(j),
        sections.distortion(j),
        sections.starts(j),
        sections.others(comparison),
        origin(j, command),
    )
    body = "\n".join(p for p in parts if p)
    title = escape(f"Fit of {j.material.model}")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>{CSS}{MORE_CSS}</style>\n</head>\n<body>\n{body}\n"
        "<footer>Made by Bondsight from the fit alone: the same fit gives the same page."
        "</footer>\n</body>\n</html>\n"
    )


def write_report(
    fit: Judged,
    path: str | Path,
    *,
    findings: Sequence[object] = (),
    comparison: Comparison | None = None,
    command: str = "",
) -> Path:
    """Write the report to an `.html` file, all or nothing; returns its path.

    Raises
    ------
    UnusableInput
        Another ending, or a file that cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in (".html", ".htm"):
        raise UnusableInput(f"{target.name}: the report is a page; name it .html")
    text = page(fit, findings=findings, comparison=comparison, command=command)
    with replacing(target) as stream:
        stream.write(text.encode("utf-8"))
    return target
