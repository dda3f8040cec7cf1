"""How a diagnosis shows itself: text, a cell of a notebook, axes, a table, a page."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.signals.files.checks import optional
from bondgraph.support.errors import UnusableInput

if TYPE_CHECKING:
    from bondgraph.drawing.panels import Panels
    from identification.diagnosis.diagnose import Diagnosis


def text(d: Diagnosis) -> str:
    """Return the verdict in words, on a screen."""
    from identification.diagnosis.verdict import in_words

    return in_words(d)


def cell(d: Diagnosis) -> str:
    """Return what a notebook shows: the answer, what was fitted, the graph, and a small studio."""
    from bondgraph.drawing.svg import svg
    from identification.diagnosis.studio.page import small

    first, _, rest = text(d).partition("\n")
    last = d.repaired or d.nominal
    graph = last.problem.graph if last is not None else d.graph
    return (
        f"<p><strong>{escape(first)}</strong></p><div>{svg(graph)}</div>"
        f"<pre>{escape(rest.strip())}</pre>"
        f'<details><summary>studio</summary><iframe title="studio" srcdoc="{escape(small(d))}" '
        'style="width:100%;height:900px;border:0"></iframe></details>'
    )


def plotted(d: Diagnosis) -> Panels:
    """Draw every reading as measured, before and after, and what is left of it over the noise.

    Returns
    -------
    Panels of matplotlib Axes, shape (n_y, 2)

    Raises
    ------
    UnusableInput
        Nothing was fitted.
    """
    from identification.report.numbers import unit_of_level
    from identification.report.readings import readings_drawn

    if d.nominal is None:
        raise UnusableInput(f"{d.model}: nothing was fitted ({d.kind}), nothing to draw")
    fits = [("as it is", d.nominal)]
    fits += [("repaired", d.repaired)] if d.repaired is not None else []
    shown = [(label, made.simulated, made.problem.data.floor) for label, made in fits]
    data = d.nominal.problem.data
    read = d.recording.read_in
    units = {n: unit_of_level(d.recording.units.get(n, ""), read.get(n, "")) for n in data.names}
    return readings_drawn(data.time, data.readings, units, data.split, shown)


def table(d: Diagnosis) -> Any:
    """Return one row a finding as a data frame; the columns are keys of ``verdict.json``."""
    from identification.diagnosis.verdict import verdict

    pandas = optional("pandas", "to_pandas", "tables")
    rows = [
        {
            "effect": f["effect"],
            "element": f["location"]["element"],
            "answer": f["answer"],
            "kind": f["kind"],
            "probability": f["probability"],
            "share_of_misfit_explained": f["share_of_misfit_explained"],
            "also_possible": ", ".join(map(_title, f["also_possible"])),
        }
        for f in verdict(d)["findings"]
    ]
    return pandas.DataFrame(rows, columns=COLUMNS)


COLUMNS = (
    "effect", "element", "answer", "kind", "probability", "share_of_misfit_explained",
    "also_possible",
)  # fmt: skip
"""Of the table, where nothing was found as well."""


def _title(rival: dict[str, Any]) -> str:
    return f"{rival.get('kind', rival['effect'])} at {rival['element']}"


def written(d: Diagnosis, folder: str | Path) -> Path:
    """Write ``verdict.json`` and ``report.html`` into a folder; returns the page's path."""
    from identification.diagnosis.explanation.recovered import characterised
    from identification.diagnosis.studio import write_report
    from identification.diagnosis.verdict import write_verdict

    write_verdict(d, Path(folder))
    return write_report(characterised(d), Path(folder))
