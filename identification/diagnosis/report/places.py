"""Section of the report that says where in the recording the model fails."""

from __future__ import annotations

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.recording import words
from identification.diagnosis.localisation.regions import Region
from identification.diagnosis.report.found import regions_of
from identification.report import html
from identification.report.numbers import prefixed, short


def places(d: Diagnosis) -> str:
    """Ranked regions in words; the studio shades and numbers those of time and frequency."""
    if d.nominal is None or d.data is None or d.kind == "insufficient_data":
        return ""
    found = [region_words(r) for r in regions_of(d)]
    listed, more = html.numbered(found[:FIRST]), found[FIRST:]
    intro = (
        "Most concentrated first; two that hold mostly the same samples are listed once. The "
        "misfit is the root mean square of what the model as it is, fitted, leaves there, over the "
        "noise there: of training and held-out samples, in that part or band alone. The numbers "
        "are those of the shaded stretches in the strip and the spectrum above."
    )
    return html.section(
        "Where in the recording the model fails",
        html.paragraph(intro if listed else _even(d)),
        listed,
        html.folded(f"{len(more)} more", html.numbered(more, FIRST + 1)) if more else "",
    )


FIRST = 5
"""Places that are read at once; the others are behind a line."""


def _even(d: Diagnosis) -> str:
    if d.kind in ("explained", "parameters_only"):
        return "The misfit is that of the noise; what rises above it is shown, not ranked."
    return "The misfit is spread evenly: no stretch carries clearly more than its share."


def region_words(r: Region) -> str:
    """Sentence about a region, in units with SI prefixes."""
    size = max(abs(r.low), abs(r.high))
    factor, unit = prefixed(r.unit, size)
    low, high = (short(v * factor if abs(v) > 1e-3 * size else 0.0, 3) for v in (r.low, r.high))
    said = words(r, (low, high, unit))
    return said[0].upper() + said[1:]
