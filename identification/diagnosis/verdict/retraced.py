"""The way to a verdict, from its file: what in the recording led there, and what else was tried."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.words import briefly
from identification.report.words import ordinal, spaced

Data = Mapping[str, Any]
REGIONS = 3
SHOWN = 6
"""Regions, and rivals of a step, that are told."""


def traces(v: Data) -> Iterator[str]:
    """Yield what in the recording led to the answer: regions, usual traces, reasons."""
    for region in v.get("regions", ())[:REGIONS]:
        yield f"Without what was found, {region}."
    for name in dict.fromkeys(f["effect"] for f in v["findings"]):
        try:
            looks = by_name(name).looks
        except (BondsightError, KeyError):
            continue
        if looks and name != "unknown":
            yield f"What {spaced(name)} looks like as a rule: {looks}."
    for k, step in enumerate(v.get("steps", ()), start=1):
        within = "" if k == 1 else f"in the {ordinal(k)} step: "
        yield from (f"{_begun(within + briefly(r))}." for r in step["reasons"])


def tried(v: Data) -> Iterator[str]:
    """Yield what each step of the search tried, the best first, and how far behind it was.

    The measure is the root mean square of what is left of all readings together, over the noise,
    on the held-out samples that choices look at.
    """
    for k, step in enumerate((s for s in v.get("steps", ()) if s["tried"]), start=1):
        found, before = step["tried"], step["before"]
        level = "" if before is None else f", before it {before:.3g} times the noise was left"
        yield f"In the {ordinal(k)} step{level}; all readings together, on held-out samples:"
        yield from (f"- {_one(t)}" for t in found[:SHOWN])
        if len(found) > SHOWN:
            yield f"- {len(found) - SHOWN} more in the file"


def _one(t: Data) -> str:
    name = "a curve without a name" if t["effect"] == "unknown" else spaced(t["effect"])
    left, z = t["over_noise"], t["behind"]
    said = f"{name} at {t['element']}"
    said += ": it could not be judged" if left is None else f" leaves {left:.3g}"
    if z is not None:
        said += f", {abs(z):.1f} standard errors {'behind' if z >= 0 else 'ahead'}"
    # files of before have such a reason where neither lies above the noise
    told = t["why"] and "nan times" not in t["why"]
    return f"{said}: {t['why']}" if told else said


def _begun(text: str) -> str:
    return text[:1].upper() + text[1:]
