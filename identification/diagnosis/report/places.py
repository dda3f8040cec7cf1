"""Section of the report that says where in the recording the model fails."""

from __future__ import annotations

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.recording import words
from identification.diagnosis.localisation.regions import Region
from identification.diagnosis.report.found import places_of, regions_of
from identification.diagnosis.report.where_figures import port_tiles, spectrum_tile, time_tile
from identification.report import html
from identification.report.numbers import prefixed, short

PORTS = 2


def places(d: Diagnosis, *, pictures: bool = True) -> str:
    """Ranked regions in words and, if wanted, as pictures: times, bands, the found port."""
    if d.nominal is None or d.data is None or d.kind == "insufficient_data":
        return ""
    found = regions_of(d)
    numbered, listed = list(enumerate(found, start=1)), html.numbered(map(region_words, found))
    marks = "; the numbers are those of the list" if found else ""
    tiles = []
    for c, name in enumerate(d.data.names if pictures else ()):
        tiles += [
            html.figure(
                time_tile(d, c, numbered),
                f"Residual of {name} over time, with its noise (band){marks}.",
            ),
            html.figure(
                spectrum_tile(d, c, numbered),
                f"Spectrum of the residual of {name} over the noise floor (dashed){marks}.",
            ),
        ]
    ports = [
        html.tiles(*(html.figure(svg, caption) for svg, caption in port_tiles(d, element)))
        for element in list(places_of(d)[0])[: PORTS if pictures else 0]
    ]
    intro = (
        "Most concentrated first; two that hold mostly the same samples are listed once. The "
        "misfit is the mean square residual over that of the noise."
    )
    return html.section(
        "Where in the recording the model fails",
        html.paragraph(intro) if listed else html.paragraph(_even(d)),
        listed,
        html.tiles(*tiles),
        *([html.heading("at the place that was found"), *ports] if any(ports) else ()),
    )


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
