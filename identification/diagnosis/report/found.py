"""What the report talks about: steps, findings, places; the same for one effect or several."""

from __future__ import annotations

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.recording.plausible import confidence_of_places
from identification.diagnosis.localisation.regions import Region
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.verdict import unresolved_place
from identification.estimation.single_record import Fit
from identification.report.words import spaced

NAMED = ("missing_physics", "unknown_physics")


def found_of(d: Diagnosis) -> tuple[Candidate, ...]:
    """Named effects in the order they were found; the closest one when nothing may be named."""
    if d.kind == "missing_physics":
        return tuple(s.chosen for s in d.findings if s.chosen is not None)
    if d.kind != "unknown_physics" or d.decision is None or d.decision.closest is None:
        return ()
    return (d.decision.closest,)


def places_of(d: Diagnosis) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return marked elements with captions, and those that cannot be told from them."""
    if d.kind == "missing_physics":
        marked = {t.element: spaced(t.effect) for t in found_of(d)}
        also = [t.element for s in d.findings for t in s.same_place]
    elif d.kind == "unknown_physics":
        place = unresolved_place(d)
        marked = {place["element"]: "unknown"} if place["element"] else {}
        also = list(place["indistinguishable_from"])
    else:
        return {}, ()
    marked = {n: c for n, c in marked.items() if n in d.graph.elements}
    dashed = sorted({n for n in also if n in d.graph.elements} - set(marked))
    return marked, tuple(dashed)


def confidence_of(d: Diagnosis) -> dict[str, float]:
    """Confidence of each element as a place, empty where nothing is missing or nothing placed."""
    if d.kind not in NAMED or (d.kind == "unknown_physics" and not unresolved_place(d)["element"]):
        return {}
    found = confidence_of_places(d.findings, d.trials)
    return {n: p for n, p in found.items() if n in d.graph.elements}


def warmth_of(d: Diagnosis) -> dict[str, float]:
    """Confidence of each element as a place, the same all over a set that the data cannot tell."""
    found = confidence_of(d)
    marked, also = places_of(d)
    sets = [{*marked, *also}]
    if d.kind == "missing_physics":
        named = [s for s in d.findings if s.chosen is not None]
        sets = [{t.element for t in (*s.possible[:1], *s.same_place)} for s in named]
    for alike in (s & set(d.graph.elements) for s in sets if found):
        total = min(1.0, sum(found.get(n, 0.0) for n in alike))
        found |= dict.fromkeys(alike, total / max(1, len(alike)))
    return found


def after_of(d: Diagnosis) -> Fit | None:
    """Return the fit to compare with the nominal one: everything named, else the closest."""
    if d.repaired is not None:
        return d.repaired
    found = found_of(d)
    return found[-1].fit if found else None


def regions_of(d: Diagnosis) -> tuple[Region, ...]:
    """Where the model as it is fails, if something is missing."""
    return d.regions if d.nominal is not None and d.kind in NAMED else ()
