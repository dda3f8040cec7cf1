"""The report as one page of HTML: inline styles and figures, no scripts, no network."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bondgraph.support.errors import UnusableInput
from bondgraph.support.whole_file import write_atomically
from identification.estimation.result import Estimation
from identification.estimation.single_record import Fit
from identification.estimation.starts import Starts
from identification.report import html
from identification.validation.compare import Comparison
from identification.validation.judge import Judgement, judge
from identification.validation.report import sections
from identification.validation.report.origin import origin
from identification.validation.validation_data import ValidationData

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
    return html.page("fit", f"Fit of {j.material.model}", parts, source="fit", same="fit")


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
    write_atomically(target, text)
    return target
